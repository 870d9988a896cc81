# SPDX-License-Identifier: MIT
"""Parts with the tolerances of PS-MPU-6000A r3.4 (6.1, 6.2), as arguments of MPU6050Chip."""

import random

_GYRO_OFFSET_DPS = 20.0
_GYRO_DRIFT_DPS_PER_C = 20.0 / 60  # +-20 dps from 25 to 85 degC
_ACCEL_OFFSET_G = (0.050, 0.050, 0.080)
_ACCEL_DRIFT_G_PER_C = (0.035 / 60, 0.035 / 60, 0.060 / 60)
_SCALE = 0.03
_CROSS_AXIS = 0.02


def worst_case(seed=0):
    """Every error at its limit, 3 % scale, 2 % cross-axis, 80 mg on z...; signs from `seed`."""
    generator = random.Random(seed)
    return _part(lambda limit: generator.choice((-limit, limit)))


def typical(seed=0):
    """A third of the limits is one sigma, and nothing goes beyond the limit."""
    generator = random.Random(seed)
    return _part(lambda limit: max(-limit, min(limit, generator.gauss(0, limit / 3))))


def _part(draw):
    return {
        "gyro_bias_dps": tuple(draw(_GYRO_OFFSET_DPS) for _ in range(3)),
        "gyro_bias_dps_per_c": tuple(draw(_GYRO_DRIFT_DPS_PER_C) for _ in range(3)),
        "accel_bias_g": tuple(draw(limit) for limit in _ACCEL_OFFSET_G),
        "accel_bias_g_per_c": tuple(draw(limit) for limit in _ACCEL_DRIFT_G_PER_C),
        "gyro_matrix": _matrix(draw),
        "accel_matrix": _matrix(draw),
        "clock_error": draw(0.01),
    }


def _matrix(draw):
    return tuple(
        tuple(1 + draw(_SCALE) if row == column else draw(_CROSS_AXIS) for column in range(3))
        for row in range(3)
    )
