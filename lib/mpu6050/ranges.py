# SPDX-License-Identifier: MIT
"""Ranges, filters and rates: code, full scale and sensitivity in one row, so that they agree.

Each function gives the register's code, which is the place in the table, and what belongs to it;
ValueError lists what there is.
"""

# Full scale, counts per unit (RM p. 29, 31)
_GYRO_DPS = ((250, 131.0), (500, 65.5), (1000, 32.8), (2000, 16.4))
_ACCEL_G = ((2, 16384), (4, 8192), (8, 4096), (16, 2048))
# Accelerometer bandwidth in Hz, the gyro's internal rate in Hz, and the gyro's delay in ms of an
# MPU6050 (RM p. 13), of the MPU-6500 family (RM-MPU-6500A p. 13), and of an ICM-20689, whose data
# sheet gives none: that of a first-order filter of its bandwidth
_DLPF_HZ = (
    (260, 8000, 0.98, 0.97, 0.64),
    (184, 1000, 1.9, 2.9, 0.90),
    (94, 1000, 2.8, 3.9, 1.73),
    (44, 1000, 4.8, 5.9, 3.88),
    (21, 1000, 8.3, 9.9, 7.96),
    (10, 1000, 13.4, 17.85, 15.9),
    (5, 1000, 18.6, 33.48, 31.8),
)
FAMILIES = ("MPU6050", "MPU-6500", "ICM-20689")  # in the order of the delays


def gyro(full_scale_dps):
    """(FS_SEL, counts per deg/s)."""
    return _row(_GYRO_DPS, full_scale_dps, "gyro_dps")


def accel(full_scale_g):
    """(AFS_SEL, counts per g)."""
    return _row(_ACCEL_G, full_scale_g, "accel_g")


def dlpf(bandwidth_hz):
    """(DLPF_CFG, internal rate of the gyro in Hz)."""
    return _row(_DLPF_HZ, bandwidth_hz, "dlpf_hz")


def delay_s(bandwidth_hz, family):
    """Delay of the gyro's low-pass in seconds, of one of FAMILIES."""
    code, _ = dlpf(bandwidth_hz)
    return _DLPF_HZ[code][2 + FAMILIES.index(family)] / 1000


def divider(gyro_rate, rate_hz):
    """SMPLRT_DIV for the rate nearest to rate_hz: gyro_rate / (1 + divider)."""
    if not gyro_rate / 256 <= rate_hz <= gyro_rate:
        limits = (rate_hz, gyro_rate / 256, gyro_rate)
        raise ValueError("rate_hz=%s: choose from %s to %s at this dlpf_hz" % limits)
    return round(gyro_rate / rate_hz) - 1


def _row(table, wanted, name):
    for code, row in enumerate(table):
        if row[0] == wanted:
            return code, row[1]
    raise ValueError("%s=%s: choose one of %s" % (name, wanted, [row[0] for row in table]))
