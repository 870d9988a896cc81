# SPDX-License-Identifier: MIT
"""What the integer attitude has learned and how far the truth may be away, in floats.

For the foreground: see attitude.bounds, attitude.gyro_learning. `state` is the filter's state().
Places and formats: this folder's __init__.
"""

from micropython import const

from attitude.bounds import YAW_NOISE, tilt_deg, yaw_deg

_SHAKE = const(220)
_VIEW = const(251)
_YAW_VIEW = const(142)
_SIGMA = const(105)
_RELATED = const(119)
_MATRIX = const(127)
_YAW_NOISE = const(138)
_YAW_BLOCKS = const(139)
_STATE = const(75)
_Q15, _Q20, _Q26, _Q30 = 32768.0, 1048576.0, 67108864.0, 1073741824.0


def _sigma(state, i):
    return state[_SIGMA - _STATE + i] / _Q30


def learned(state, bias_dps, bias_sigma_dps):
    """See Attitude.learned."""
    scale = tuple([-state[_MATRIX - _STATE + i] / _Q30 for i in (0, 4, 8)])
    scale_sigma = tuple([_sigma(state, i) for i in (3, 7, 11)])
    return scale, scale_sigma, bias_dps, bias_sigma_dps


def matrix(state):
    """Identity and what was learned."""
    return tuple(
        [(i % 4 == 0) + state[_MATRIX - _STATE + i] / _Q30 for i in range(9)]
    )


def _variance(state, view):
    """Of what the errors add up to in this view of 14 numbers, or 12."""
    shares = [v * _sigma(state, i) for i, v in enumerate(view)]
    total = sum([share * share for share in shares])
    for i, (a, b) in enumerate(((7, 11), (11, 3), (3, 7))):
        total += 2.0 * shares[a] * shares[b] * state[_RELATED - _STATE + i] / _Q15
    return max(0.0, total)


def tilt_sigma_deg(state):
    """See Attitude.tilt_sigma_deg."""
    variance = 0.0
    for axis in (0, 1):
        at = _VIEW - _STATE + 39 * axis
        view = [state[at + i] / _Q20 for i in range(12)] + [0.0, 0.0]
        view[12 + axis] = state[at + 12] / _Q20
        variance += _variance(state, view)
    return tilt_deg(variance, state[_SHAKE - _STATE] / _Q30)


def yaw_sigma_deg(state, block_s):
    """See Attitude.yaw_sigma_deg; block_s: nominal time of a block."""
    view = [state[_YAW_VIEW - _STATE + i] / _Q20 for i in range(12)]
    more = state[_YAW_NOISE - _STATE] / _Q26
    more += YAW_NOISE * YAW_NOISE * block_s * state[_YAW_BLOCKS - _STATE]
    return yaw_deg(_variance(state, view) + more)
