# SPDX-License-Identifier: MIT
"""Settings of the integer Attitude, in seconds, deg/s and g, to its integer coefficients."""

from math import degrees, radians

from micropython import const

from attitude.counts import ACCEL_LSB_PER_G, GYRO_LSB_PER_DPS
from attitude.fixed.folding import mantissa

INC_PER_DPS = 4685077.9  # 2^30 / 4 in radians: times dt it is "inc"
BLOCK_S, LOOK_S, YOUNG_S, OLD_S = 0.08, 0.24, 0.72, 100.0  # as in the float Attitude
_FULL_SCALE = 32768 * 1.9  # of three axes and a calibration together
_SPREAD = 0.7  # rad: longest lag_s * rate that the lag correction's formats hold
_G = 9.80665
_Q30 = 1073741824.0

# places and formats: this folder's __init__
_E_SHIFT = const(28)
_LAG_PRE = const(29)
_LAG = const(30)
_LAG_POST = const(31)
_ONE = const(32)
_N = const(33)
_START = const(72)
_SCALE = const(73)
_CROSS = const(74)


def set_up(
    s,
    rate_hz,
    gyro_dps,
    accel_g,
    tau_s=2.3,
    rest_tau_s=0.5,
    most_dps=0.2,
    most_sigmas=2,
    top_speed_m_s=25,
    start_sigma_dps=10,
    scale_sigma=0.02,
    cross_sigma=0.003,
    bias_tau_s=30,
    rest_bias_s=6,
    rest_s=1.5,
    rest_gyro_dps=1,
    rest_accel_g=0.04,
    rest_shaken_g=16,
    bias_limit_dps=2,
    start_bias_dps=20,
    lag_s=0.0048,
):
    """Fill the array s from E_SHIFT on.

    start_bias_dps and start_sigma_dps at most 40, sigmas at most 0.2, most_sigmas 100. lag_s is
    cut at what the range allows: 10 ms at 2000 deg/s. ValueError says what is wrong.
    """
    if not min(tau_s, rest_tau_s, bias_tau_s, rest_bias_s, rest_s, top_speed_m_s) > 0:
        raise ValueError("top_speed_m_s and time constants must be positive")
    if not (start_bias_dps <= 40 and bias_limit_dps <= start_bias_dps):
        raise ValueError("start_bias_dps: at most 40, and not below bias_limit_dps")
    if not (0 < start_sigma_dps <= 40 and 0 <= scale_sigma <= 0.2 and 0 <= cross_sigma <= 0.2):
        raise ValueError("start_sigma_dps: 0 to 40; scale_sigma, cross_sigma: 0 to 0.2")
    if not lag_s >= 0:
        raise ValueError("lag_s: must not be negative")
    dt = 1 / rate_hz
    n = max(1, int(rate_hz * BLOCK_S + 1e-6))
    span = n * dt
    inc = INC_PER_DPS * dt
    lsb_per_g = ACCEL_LSB_PER_G[accel_g]

    s[_E_SHIFT] = {16: 0, 8: 1, 4: 2, 2: 3}[accel_g]
    dps = _FULL_SCALE / GYRO_LSB_PER_DPS[gyro_dps]
    lag_s = min(lag_s, _SPREAD / (dps * 0.0174533))
    pre = 0
    while inc * dps / (1 << pre) >= 32768:
        pre += 1
    s[_LAG_PRE] = pre
    s[_LAG], s[_LAG_POST] = mantissa(lag_s * 4 / dt / 32768 * (1 << pre))
    s[_ONE] = 1 << 30
    young = max(1, int(YOUNG_S / span + 0.99))
    mg, mg_shift = mantissa(32768 * 4096 / (n * lsb_per_g))
    look = max(1, int(LOOK_S / span + 0.49999))
    ticks = max(1, (n - 1) // 6)  # of a block, for the view; two pace, twelve learn
    most = radians(min(most_dps, 2000))
    coefficients = (
        n,
        32768 * min(1, span / 0.5),
        rest_gyro_dps * inc * n,
        rest_accel_g * lsb_per_g * n * 64,
        rest_shaken_g * lsb_per_g * n * 64,
        0.05 * lsb_per_g * n * 64,
        0.2 * inc * n,
        0.0005 * span * inc * n * 256,
        bias_limit_dps * inc * n,
        start_bias_dps * inc * n,
        120 / span,
        rest_s / span + 0.99,
        max(1, rest_bias_s / span),
        1 / span + 0.99,
        young,
        OLD_S / span,
        _gain(2 * dt / (young * span)) * young,
        _gain(dt / tau_s),
        _gain(dt / rest_tau_s),
        lsb_per_g // 2,
        2 * rate_hz,
        mg,
        mg_shift,
        32768 * min(1, span / 3),
        1 / (span * span),
        degrees(inc * n) / 512,
        degrees(inc * 256),
        32768 * span,
        0.3 * tau_s * 4096,
        most * 16777216,
        min(most_sigmas, 100) * 256,
        (min(top_speed_m_s, 200) / _G / span * 64) ** 2,
        32768 * span / 10,
        min(5e8, radians(0.9 / bias_tau_s) ** 2 * look * span * 17592186044416.0),
        radians(0.002) * span * 4294967296.0,
        32768 * span / 5,
        32768 * (1 - span / 40) + 0.5,
        look,
        (13 + ticks - 1) // ticks,
    )
    for i, value in enumerate(coefficients):
        s[_N + i] = int(value)
    know(s, start_sigma_dps, scale_sigma)
    s[_CROSS] = int(cross_sigma * _Q30)


def know(s, start_sigma_dps=10, scale_sigma=0.02, **others):
    """Of set_up() what a calibration tells."""
    s[_START] = int(max(65536, radians(start_sigma_dps) * _Q30))
    s[_SCALE] = int(scale_sigma * _Q30)


def _gain(k):
    return 16777216 * min(k, 0.249999)
