# SPDX-License-Identifier: MIT
"""The parts that are sold as MPU6050, each by what its own register map says.

Sources: RM-MPU-6000A r4.2 and PS-MPU-6000A r3.4, RM-MPU-6500A r2.1, ICM-20689 DS-000143 r1.1.
A filter row is (bandwidth_hz, delay_s, sample rate in Hz); a delay of None is the filter's own.
"""

from typing import NamedTuple

ADDRESS = 0x68
GYRO_LSB_PER_DPS = (131.0, 65.5, 32.8, 16.4)
ACCEL_LSB_PER_G = (16384.0, 8192.0, 4096.0, 2048.0)


class Profile(NamedTuple):
    """What one kind of part does differently. Rates in Hz, temperatures in degC."""

    who_am_i: int
    power_reset: int = 0x40  # PWR_MGMT_1 after reset: asleep
    gyro_filters: tuple = ()
    accel_filters: tuple = ()
    accel_filter_register: int | None = None  # None: CONFIG sets both filters
    fifo_bytes: int = 1024
    fifo_can_stop: bool = False  # CONFIG bit 6: a full FIFO takes no more
    temp_lsb_per_c: float = 340.0
    temp_zero_c: float = 36.53  # temperature at which the register reads 0
    accel_offsets: tuple = (0x06, 0x08, 0x0A)
    motion_engine: bool = True
    self_test: str = "6050"
    cycle: str = "lp_wake"
    gyro_noise: float = 0.005  # dps / sqrt(Hz)
    accel_noise: float = 400e-6  # g / sqrt(Hz)


def _rows(rate_hz, *rows):
    return tuple((hz, None if ms is None else ms * 1e-3, rate_hz) for hz, ms in rows)


_GYRO_6050 = _rows(8000, (256, 0.98)) + _rows(
    1000, (188, 1.9), (98, 2.8), (42, 4.8), (20, 8.3), (10, 13.4), (5, 18.6)
)
_ACCEL_6050 = _rows(
    1000, (260, 0.0), (184, 2.0), (94, 3.0), (44, 4.9), (21, 8.5), (10, 13.8), (5, 19.0)
)
_GYRO_6500 = (
    *_rows(8000, (250, 0.97)),
    *_rows(1000, (184, 2.9), (92, 3.9), (41, 5.9), (20, 9.9), (10, 17.85), (5, 33.48)),
    *_rows(8000, (3600, 0.17)),
)
_ACCEL_6500 = _rows(
    1000, (460, 1.94), (184, 5.8), (92, 7.8), (41, 11.8), (20, 19.8), (10, 35.7), (5, 66.96)
) + _rows(1000, (460, 1.94))
_GYRO_20689 = (
    *_rows(8000, (250, None)),
    *_rows(1000, (176, None), (92, None), (41, None), (20, None), (10, None), (5, None)),
    *_rows(8000, (3281, None)),
)
_ACCEL_20689 = _rows(
    1000,
    *((hz, None) for hz in (218.1, 218.1, 99, 44.8, 21.2, 10.2, 5.1, 420)),
)

_MPU6050 = Profile(
    0x68,
    gyro_filters=(*_GYRO_6050, *_rows(8000, (256, 0.98))),  # 7 is reserved
    accel_filters=(*_ACCEL_6050, *_rows(1000, (260, 0.0))),
)
_MPU6500 = Profile(
    0x70,
    power_reset=0x01,  # this family wakes up running
    gyro_filters=_GYRO_6500,
    accel_filters=_ACCEL_6500,
    accel_filter_register=0x1D,
    fifo_bytes=512,
    fifo_can_stop=True,
    temp_lsb_per_c=333.87,
    temp_zero_c=21.0,
    accel_offsets=(0x77, 0x7A, 0x7D),
    motion_engine=False,
    self_test="6500",
    cycle="odr",
    gyro_noise=0.01,
    accel_noise=300e-6,
)

PROFILES = {
    "MPU6050": _MPU6050,
    "MPU6500": _MPU6500,
    "MPU9250": _MPU6500._replace(who_am_i=0x71),
    "MPU9255": _MPU6500._replace(who_am_i=0x73),
    "MPU6515": _MPU6500._replace(who_am_i=0x74),
    "ICM20689": _MPU6500._replace(
        who_am_i=0x98,
        power_reset=0x40,
        gyro_filters=_GYRO_20689,
        accel_filters=_ACCEL_20689,
        fifo_bytes=4096,
        temp_lsb_per_c=326.8,
        temp_zero_c=25.0,
        cycle="divider",
        gyro_noise=0.006,
        accel_noise=150e-6,
    ),
}


def find(profile):
    """The Profile for a name, a WHO_AM_I value, or a Profile itself; ValueError otherwise."""
    if isinstance(profile, Profile):
        return profile
    for name, candidate in PROFILES.items():
        if profile in (name, candidate.who_am_i):
            return candidate
    raise ValueError(f"no profile {profile!r}; there are {', '.join(PROFILES)}")


def trim_dps(profile, codes):
    """Self-test response of the gyro, dps on x, y, z, that the factory codes stand for."""
    if profile.self_test == "6050":  # 25 x 131 x 1.046^(code - 1) LSB at 250 dps; y is negative
        signs = (25.0, -25.0, 25.0)
        return tuple(s * 1.046 ** (c - 1) if c else 0.0 for s, c in zip(signs, codes))
    return tuple(2620 * 1.01 ** (c - 1) / 131 if c else 0.0 for c in codes)


def trim_g(profile, codes):
    """Self-test response of the accelerometer, g on x, y, z, that the codes stand for."""
    if profile.self_test == "6050":  # 4096 x 0.34 x (0.92/0.34)^((code - 1)/30) LSB at 8 g
        return tuple(0.34 * (0.92 / 0.34) ** ((c - 1) / 30) if c else 0.0 for c in codes)
    return tuple(2620 * 1.01 ** (c - 1) / 16384 if c else 0.0 for c in codes)
