# SPDX-License-Identifier: MIT
"""The integer attitude's numbers in floats: where it stands, and how to begin elsewhere.

Rare, for the foreground; places and formats: this folder's __init__. `s` is the filter's array,
`state` its state(), all of one instant.
"""

from micropython import const

from attitude.fixed.attitude.coefficients import INC_PER_DPS
from attitude.fixed.attitude.errors import spread
from attitude.quaternion import rotate_back, unit
from attitude.standing import angles_mdeg, turned

_LAG_PRE = const(29)
_LAG = const(30)
_LAG_POST = const(31)
_OLD = const(48)
_YOUNG = const(47)
_W = const(76)
_TRIM = const(166)
_LAST = const(167)
_BIAS = const(81)
_BEGIN = const(80)
_ROLL = const(155)
_RATES = const(158)
_FORCE = const(161)
_BEFORE = const(96)
_NEXT = const(99)
_AGE = const(208)
_LEARNED = const(103)
_MOVED = const(104)
_EVENT = const(221)
_SIGMA = const(105)
_STATE = const(75)
_DEG = 57.29578
_MOST_DPS = 39.0  # of bias: what the formats hold, and twice what the datasheet allows


def _part(state, at, n=3):
    return state[at - _STATE : at - _STATE + n]


def _attitude(state):
    return unit([v / 1073741824.0 for v in _part(state, _W, 4)])


def standing(s, state, rate_hz):
    """See attitude.standing."""
    if state[_BEGIN - _STATE] > 1:
        return None
    scale = rate_hz / INC_PER_DPS
    home = None
    if state[_LEARNED - _STATE]:
        home = [b * scale / 256.0 for b in _part(state, _BEFORE)]
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
    s[_AGE] = s[_OLD] if home else s[_YOUNG]
    # the tilt is unknown, or a rest has shown it
    s[_EVENT] = 2 if home and not any(rates) else 8
    for i in range(3):
        # a filter that has not told its bias at rest may not know all of it; deg/s
        known = 0.01 if home else max(3.0, abs(_bounded(bias[i])))
        s[_LAST + i] = round(rates[i] * inc)
        s[_RATES + i] = round(rates[i] * 1000.0)
        s[_BIAS + i] = round(_bounded(bias[i]) * inc * 256.0)
        s[_SIGMA + i] = int(known / _DEG * 1073741824.0)
        if home:
            s[_LEARNED] = 1
            s[_BEFORE + i] = s[_NEXT + i] = round(_bounded(home[i]) * inc * 256.0)
    spread(s)
    place(s, q, rate_hz)


def _bounded(bias_dps):
    return max(-_MOST_DPS, min(_MOST_DPS, bias_dps))
