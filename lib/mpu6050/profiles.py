# SPDX-License-Identifier: MIT
"""Which part this is: the genuine MPU6050, or one of those sold as it, known by WHO_AM_I.

The register maps of the MPU-6500 (RM-MPU-6500A r2.1) and ICM-20689 (DS-000143) families agree
with the MPU6050's in all that the driver uses, except for what stands in a `Profile`.
"""

from collections import namedtuple

from micropython import const

_CONFIG = const(0x1A)  # DLPF_CFG [2:0]
_ACCEL_CONFIG_2 = const(0x1D)  # MPU-6500 family: FCHOICE_B [3], A_DLPF_CFG [2:0]
_WHO_AM_I = const(0x75)
KNOWN = (0x68, 0x70, 0x71, 0x73, 0x74, 0x98)  # every WHO_AM_I that known() knows

# family: of ranges.FAMILIES; accel_filter: has ACCEL_CONFIG_2;
# degC = counts / temp_lsb_per_c + temp_offset_c;
# accel_offsets: first offset register; motion: has the motion interrupt
Profile = namedtuple(
    "Profile",
    (
        "name",
        "family",
        "accel_filter",
        "temp_lsb_per_c",
        "temp_offset_c",
        "fifo_bytes",
        "accel_offsets",
        "motion",
    ),
)


def _like_6500(name):
    return Profile(name, "MPU-6500", True, 333.87, 21.0, 512, 0x77, False)


def _like_6050(name):
    return Profile(name, "MPU6050", False, 340.0, 36.53, 1024, 0x06, True)


def known(who_am_i):
    """The Profile that belongs to a WHO_AM_I, or None."""
    if who_am_i == 0x68:
        return _like_6050("MPU6050")
    if who_am_i == 0x98:
        return Profile("ICM-20689", "ICM-20689", True, 326.8, 25.0, 4096, 0x77, False)
    name = {0x70: "MPU-6500", 0x71: "MPU-9250", 0x73: "MPU-9255", 0x74: "MPU-6515"}.get(who_am_i)
    return _like_6500(name) if name else None


def take_on(device, who_am_i):
    """Give the device the Profile of another part and its rows; False when that is unknown."""
    profile = known(who_am_i)
    if profile is None:
        return False
    device.who_am_i, device.profile = who_am_i, profile
    filter_row(device)
    return True


def filter_row(device):
    """Give the table its row for the second filter register where the part has one, else none."""
    rows = bytearray()
    table = device._table
    code = 0
    for at in range(0, len(table), 3):
        if table[at] == _CONFIG:
            code = table[at + 1]
        if table[at] != _ACCEL_CONFIG_2:
            rows.extend(table[at : at + 3])
    if device.profile.accel_filter:
        rows.extend(bytes((_ACCEL_CONFIG_2, code, 0x0F)))
    device._table = rows
    device.rewind()


def identify(device, allow_unknown, wait_ms, seen):
    """(WHO_AM_I, Profile) of the part that answers within wait_ms; OSError, with what was `seen`
    instead (Registers.ask), when none does or it is unknown.

    `allow_unknown` takes an unknown id for a genuine MPU6050.
    """
    who = device.ask(_WHO_AM_I, KNOWN, wait_ms, seen)
    profile = None if who is None else known(who)
    if profile is None and who is not None and allow_unknown:
        profile = _like_6050("unknown 0x%02X" % who)
    if profile is None:
        from mpu6050.diagnose import refused

        raise refused(device, seen)
    return who, profile
