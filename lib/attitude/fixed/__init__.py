# SPDX-License-Identifier: MIT
"""Integer twins of the filters: raw counts in, millidegrees out, nothing allocated.

A name is loaded from its own file when it is first asked for, as in `attitude`.
"""

import sys

import attitude.fixed.compiler_check  # raises where viper was compiled wrongly

del sys.modules["attitude.fixed.compiler_check"], attitude.fixed.compiler_check  # its room

_HOME = {
    "AdaptiveNotch": "biquad",
    "Attitude": "attitude",
    "Complementary": "complementary",
    "Kalman1D": "kalman1d",
    "KalmanTilt2": "kalman_tilt2",
    "LowPass": "biquad",
    "MovingAverage": "moving_average",
    "Notch": "biquad",
}


def __getattr__(name):
    home = _HOME.get(name)
    if home is None:
        raise AttributeError("attitude.fixed has no %s" % name)
    value = getattr(__import__("attitude.fixed." + home, None, None, (name,)), name)
    globals()[name] = value
    return value
