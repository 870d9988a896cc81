# SPDX-License-Identifier: MIT
"""The integer attitude's numbers in floats: where it stands, and how to begin elsewhere.

Rare, for the foreground; places and formats: this folder's __init__. `s` is the filter's array,
`state` its state(), all of one instant.
"""

from micropython import const

from attitude.fixed.attitude.coefficients import INC_PER_DPS
from attitude.quaternion import rotate_back, unit
from attitude.standing import angles_mdeg, turned

_LAG_PRE = const(29)
_LAG = const(30)
_LAG_POST = const(31)
_N = const(33)
_RESTED_MAX = const(42)
_YOUNG = const(43)
_KNOWN_MAX = const(49)
_LEARN_AGE = const(50)
_W = const(56)
_TRIM = const(60)
_LAST = const(61)
_BIAS = const(64)
_BEGIN = const(81)
_ROLL = const(88)
_RATES = const(91)
_FORCE = const(94)
_HOME_BIAS = const(107)
_HOME = const(104)
_AGE = const(114)
_RESTED = const(116)
_LEARNED = const(117)
_MOVED = const(118)
_KNOWN = const(120)
_STATE = const(55)
_DEG = const(57.29578)
_MOST_DPS = const(40.0)  # of bias: what the formats hold, and twice what the datasheet allows


def _part(state, at, n=3):
    return state[at - _STATE : at - _STATE + n]


def _attitude(state):
    return unit([v / 1073741824.0 for v in _part(state, _W, 4)])


def standing(s, state, rate_hz):
    """See attitude.standing."""
    if state[_BEGIN - _STATE] == 2:
        return None
    scale = rate_hz / INC_PER_DPS
    home = None
    if state[_LEARNED - _STATE]:
        home = [h * scale / s[_N] for h in _part(state, _HOME)]
    rates = [rate * scale for rate in _part(state, _LAST)]
    return _attitude(state), rates, [b * scale / 256.0 for b in _part(state, _BIAS)], home


def quaternion(s, state, rate_hz):
    """(w, x, y, z) turned on by lag_s at the last rate."""
    lag = s[_LAG] / (1 << s[_LAG_PRE]) / (1 << s[_LAG_POST])  # angle Q15 by inc
    lag_s = lag / 32768.0 * _DEG * INC_PER_DPS / rate_hz
    rates = [rate * rate_hz / INC_PER_DPS for rate in _part(state, _LAST)]
    return turned(_attitude(state), rates, lag_s)


def linear_accel_g(state, lsb_per_g):
    """Acceleration without gravity in the robot's frame, g."""
    gravity = rotate_back(_attitude(state), 0.0, 0.0, 1.0)
    return tuple([f / lsb_per_g - g for f, g in zip(_part(state, _FORCE), gravity)])


def place(s, q, rate_hz):
    """Set the attitude, and the angles that belong to it."""
    for i in range(4):
        s[_W + i] = round(q[i] * 1073741824.0)
    s[_TRIM] = 0
    for i, angle in enumerate(angles_mdeg(quaternion(s, memoryview(s)[_STATE:], rate_hz))):
        s[_ROLL + i] = angle


def begin_at(s, there, rate_hz):
    """Fill a state that has just begun with that of another filter."""
    q, rates, bias, home = there
    inc = INC_PER_DPS / rate_hz
    s[_BEGIN] = 1
    s[_MOVED] = 1
    s[_AGE] = s[_YOUNG]  # a filter that has not told its bias at rest may not know all of it
    if home:
        s[_AGE] = s[_LEARN_AGE]
        s[_LEARNED] = 1
        s[_RESTED] = s[_RESTED_MAX]
        s[_KNOWN] = s[_KNOWN_MAX]
    for i in range(3):
        s[_LAST + i] = round(rates[i] * inc)
        s[_RATES + i] = round(rates[i] * 1000.0)
        s[_BIAS + i] = round(_bounded(bias[i]) * inc * 256.0)
        rest = _bounded((home or bias)[i]) * inc
        s[_HOME + i] = round(rest * s[_N])
        s[_HOME_BIAS + i] = round(rest * 256.0)
    place(s, q, rate_hz)


def _bounded(bias_dps):
    return max(-_MOST_DPS, min(_MOST_DPS, bias_dps))
