# SPDX-License-Identifier: MIT
"""Settings of the integer Attitude, in seconds, deg/s and g, to its integer coefficients."""

from micropython import const

from attitude.counts import ACCEL_LSB_PER_G, GYRO_LSB_PER_DPS
from attitude.fixed.folding import mantissa

INC_PER_DPS = 4685077.9  # 2^30 / 4 in radians: times dt it is "inc"
_FULL_SCALE = const(32768 * 1.9)  # of three axes and a calibration together
_SPREAD = const(0.7)  # rad: longest lag_s * rate that the lag correction's formats hold

# places and formats: this folder's __init__
_E_SHIFT = const(28)
_LAG_PRE = const(29)
_LAG = const(30)
_LAG_POST = const(31)
_ONE = const(32)
_N = const(33)


def samples(rate_hz):
    """How many samples a block has at this rate."""
    return max(1, int(rate_hz * 0.02 + 0.5))


def set_up(
    s,
    rate_hz,
    gyro_dps,
    accel_g,
    tau_s=1.8,
    fast_dps=1500.0,
    rest_tau_s=0.5,
    bias_tau_s=30.0,
    rest_bias_s=6.0,
    rest_s=1.5,
    rest_gyro_dps=1.0,
    rest_accel_g=0.04,
    bias_limit_dps=2.0,
    start_bias_dps=20.0,
    lag_s=0.0048,
):
    """Fill the array s from E_SHIFT on.

    start_bias_dps at most 40. lag_s is cut at what the range allows: 10 ms at 2000 deg/s.
    ValueError says what is wrong.
    """
    if not min(tau_s, fast_dps, rest_tau_s, bias_tau_s, rest_bias_s, rest_s) > 0:
        raise ValueError("time constants must be positive")
    if not (start_bias_dps <= 40 and bias_limit_dps <= start_bias_dps):
        raise ValueError("start_bias_dps: at most 40, and not below bias_limit_dps")
    if not lag_s >= 0:
        raise ValueError("lag_s: must not be negative")
    dt = 1.0 / rate_hz
    n = samples(rate_hz)
    span = n * dt
    inc = INC_PER_DPS * dt
    lsb_per_g = ACCEL_LSB_PER_G[accel_g]

    s[_E_SHIFT] = {16: 0, 8: 1, 4: 2, 2: 3}[accel_g]
    dps = _FULL_SCALE / GYRO_LSB_PER_DPS[gyro_dps]
    lag_s = min(lag_s, _SPREAD / (dps * 0.0174533))
    _lag(s, inc * dps, lag_s * 4.0 / dt / 32768.0)
    s[_ONE] = 1 << 30
    young = max(1, int(tau_s / span + 0.99))
    fast = _gain(dt / tau_s) / (fast_dps * inc * n)
    fast, fast_shift = mantissa(fast * 32768.0)
    coefficients = (
        n,
        32768.0 * min(1.0, span / 0.5),
        rest_gyro_dps * inc * n,
        rest_accel_g * lsb_per_g * n * 64.0,
        start_bias_dps * inc * n,
        bias_limit_dps * inc * n,
        start_bias_dps * inc * 256.0,
        bias_limit_dps * inc * 256.0,
        rest_s / span + 0.99,
        max(1.0, rest_bias_s / span),
        young,
        _gain(2.0 * dt / (young * span)) * young,
        _gain(dt / tau_s),
        _gain(dt / rest_tau_s),
        lsb_per_g // 2,
        5.0 / span,
        max(bias_tau_s, 5.0) / span,
        4.0 * tau_s / span,
        2.0 * rate_hz,
        32768.0 * min(1.0, span / 3.0),
        fast,
        fast_shift,
    )
    for i, value in enumerate(coefficients):
        s[_N + i] = int(value)


def _gain(k):
    return 16777216.0 * min(k, 0.249999)


def _lag(s, largest, ratio):
    pre = 0
    while largest / (1 << pre) >= 32768.0:
        pre += 1
    s[_LAG_PRE] = pre
    s[_LAG], s[_LAG_POST] = mantissa(ratio * (1 << pre))
