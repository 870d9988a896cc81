# SPDX-License-Identifier: MIT
"""Integer twins of the filters: raw counts in, millidegrees out, nothing allocated.

A name is loaded from its own file when it is first asked for, as in `attitude`.
"""

import sys

from attitude.fixed import compiler_check  # raises where viper was compiled wrongly

del sys.modules["attitude.fixed.compiler_check"], compiler_check  # which has been said by now

_HOMES = """
attitude Attitude
biquad AdaptiveNotch LowPass Notch
complementary Complementary
kalman1d Kalman1D
kalman_tilt2 KalmanTilt2
moving_average MovingAverage
"""


def __getattr__(name):
    for row in _HOMES.split("\n"):
        if name in row.split(" ")[1:]:
            home = "attitude.fixed." + row.split(" ")[0]
            value = getattr(__import__(home, None, None, (name,)), name)
            globals()[name] = value
            return value
    raise AttributeError("attitude.fixed has no %s" % name)
