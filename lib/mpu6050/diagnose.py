# SPDX-License-Identifier: MIT
"""Why the sensor cannot be used, in words; loaded only when it cannot."""

import errno

from micropython import const

_WHO_AM_I = const(0x75)
_TIMED_OUT = (110, 116)  # ETIMEDOUT on rp2 and on esp32
_EXPECTED = "expected 0x68 (or 0x70, 0x71, 0x73, 0x74, 0x98 of its relatives)"
_DEAD = (0x00, 0xFF)
_MANY = const(5)


def refused(device, seen):
    """The OSError to raise: what was asked, what came how often, what to check.

    seen: {answer, or the errno of a failure negated: how often}, from Registers.ask().
    """
    address = device.address
    failed = sum([n for got, n in seen.items() if got < 0])
    total = sum(seen.values())
    text = "MPU6050: asked %d times at 0x%02X for WHO_AM_I (0x75): %s; %s. " % (
        total,
        address,
        _counted(seen),
        _EXPECTED,
    )
    most = max(seen, key=seen.get)
    if failed == total:
        code = -most
        return OSError(code, text + _no_answer(device, code))
    if 2 * failed > total:
        code, hint = -most if most < 0 else errno.EIO, "It answers now and then: "
        hint += "a loose contact, long wires or missing pull-ups (4.7 kOhm to 3.3 V)."
        return OSError(code, text + hint)
    return OSError(errno.ENODEV, text + _wrong_id(device, most, seen[most] + failed < total))


def _counted(seen):
    """The commonest answers with how often they came."""
    order = sorted(seen, key=lambda got: -seen[got])
    words = []
    for got in order[:_MANY]:
        name = "0x%02X" % got if got >= 0 else str(errno.errorcode.get(-got, -got))
        words.append("%s %d times" % (name, seen[got]))
    if len(order) > _MANY:
        words.append("%d others" % (len(order) - _MANY))
    return ", ".join(words)


def _no_answer(device, code):
    if code in _TIMED_OUT:
        return (
            "The bus is stuck, SDA or SCL is held low: check for a short and for missing "
            "pull-ups (4.7 kOhm to 3.3 V); power the sensor off and on."
        )
    address = device.address
    other = 0x69 if address == 0x68 else 0x68
    found = _scan(device)
    if other in found or _who(device, other) is not None:
        return _other(other)
    if found:
        text = "Others answer on this bus (%s): " % ", ".join(["0x%02X" % a for a in found])
        return text + "check the sensor's power and AD0 (low 0x68, high 0x69)."
    return (
        "Nothing answers on this bus: check 3.3 V and GND, SDA and SCL (swapped?), "
        "the pins and bus number given to I2C(), and the pull-ups."
    )


def _wrong_id(device, most, unsteady):
    if unsteady:
        return (
            "The answers change: noise on the lines. Check pull-ups (4.7 kOhm to 3.3 V), "
            "shorter wires, a slower bus, the supply."
        )
    if most in _DEAD:
        return "The data line seems dead: check SDA, its pull-up and the power."
    from mpu6050.profiles import KNOWN

    address = device.address
    other = 0x69 if address == 0x68 else 0x68
    text = ""
    if _is_clock(device):
        text = "It looks like a clock chip (DS1307, DS3231), which has this address too. "
    if _who(device, other) in KNOWN:
        return text + _other(other)
    if text:
        return text + "Wire the sensor's AD0 to 3.3 V and use address=0x69."
    return (
        "Another device has this address (clock chips DS1307 and DS3231 do: then wire AD0 to "
        "3.3 V and use address=0x69), or it is a clone: allow_unknown=True takes it as an MPU6050."
    )


def _other(address):
    return "A device answers at 0x%02X: AD0 is wired %s, so use address=0x%02X." % (
        address,
        "high" if address == 0x69 else "low",
        address,
    )


def _is_clock(device):
    """Whether its first seven registers hold a time and a date, digit by digit."""
    now = bytearray(7)
    try:
        _alone(device, device.bus.readfrom_mem_into, device.address, 0, now)
    except OSError:
        return False
    now[0] &= 0x7F  # stopped
    now[2] &= 0x3F  # 12 or 24 hours
    now[5] &= 0x7F  # century
    limits = ((0, 0x59), (0, 0x59), (0, 0x32), (1, 7), (1, 0x31), (1, 0x12), (0, 0x99))
    for value, (low, high) in zip(now, limits):
        if not low <= value <= high or value & 0x0F > 9:
            return False
    return True


def _who(device, address):
    byte = bytearray(1)
    try:
        _alone(device, device.bus.readfrom_mem_into, address, _WHO_AM_I, byte)
        return byte[0]
    except OSError:
        return None


def _scan(device):
    try:
        return _alone(device, device.bus.scan)
    except (OSError, AttributeError):  # AttributeError: not every bus object can scan
        return []


def _alone(device, transfer, *arguments):
    """The bus may be shared with what ticks."""
    if not device.lock:
        return transfer(*arguments)
    with device.lock:
        return transfer(*arguments)
