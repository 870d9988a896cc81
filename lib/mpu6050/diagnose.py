# SPDX-License-Identifier: MIT
"""Why the sensor cannot be used, in words; loaded only when it cannot."""

import errno

_TIMED_OUT = (110, 116)  # ETIMEDOUT on rp2 and on esp32


def no_answer(device, error):
    """The OSError to raise when nothing was read: what was tried, what seen, what to check."""
    i2c, address = device.bus, device.address
    code = error.args[0] if error.args else errno.EIO
    text = "MPU6050: no answer at 0x%02X (%s); expected WHO_AM_I (0x75) = 0x68. " % (
        address,
        errno.errorcode.get(code, code),
    )
    if code in _TIMED_OUT:
        text += "The bus is stuck, SDA or SCL is held low: check for a short and for missing "
        text += "pull-ups (4.7 kOhm to 3.3 V); power the sensor off and on."
        return OSError(code, text)
    other = 0x69 if address == 0x68 else 0x68
    found = _scan(i2c)
    if other in found or _answers(i2c, other):
        text += "A device answers at 0x%02X: AD0 is wired %s, so use address=0x%02X." % (
            other,
            "high" if other == 0x69 else "low",
            other,
        )
    elif found:
        text += "Others answer on this bus (%s): " % ", ".join(["0x%02X" % a for a in found])
        text += "check the sensor's power and AD0 (low 0x68, high 0x69)."
    else:
        text += "Nothing answers on this bus: check 3.3 V and GND, SDA and SCL (swapped?), "
        text += "the pins and bus number given to I2C(), and the pull-ups."
    return OSError(code, text)


def wrong_id(address, who_am_i):
    """The OSError to raise for a WHO_AM_I that no known part has."""
    hint = "Another device has this address, or it is a clone: try allow_unknown=True."
    if who_am_i in (0x00, 0xFF):
        hint = "The data line seems dead: check SDA, its pull-up and the power."
    text = "MPU6050 at 0x%02X: WHO_AM_I (0x75) reads 0x%02X, expected 0x68 (or 0x70, 0x71, 0x73, "
    text += "0x74, 0x98 of its relatives). "
    return OSError(errno.ENODEV, text % (address, who_am_i) + hint)


def _answers(i2c, address):
    try:
        i2c.readfrom_mem(address, 0x75, 1)
        return True
    except OSError:
        return False


def _scan(i2c):
    try:
        return i2c.scan()
    except (OSError, AttributeError):  # AttributeError: not every bus object can scan
        return []
