# SPDX-License-Identifier: MIT
"""Attitude filters: float classes that read like their equations; integer twins in attitude.fixed.

A name is loaded from its own file when it is first asked for, so a board that runs one filter
holds one filter in RAM.
"""

# file, names: one text, since each name of a board's dict takes room that others need
_HOMES = """
attitude Attitude
complementary Complementary
float_attitude FloatAttitude
float_tilt FloatTilt
kalman1d Kalman1D
kalman_nd KalmanND
kalman_tilt KalmanTilt
moving_average MovingAverage
paper_tilts GyroIntegral tilt_asin_deg tilt_atan_deg tilt_two_axes_deg yaw_transfer_deg
tilt accel_tilt_deg wrap_deg
"""


def __getattr__(name):
    if name == "fixed":  # MicroPython looks for a submodule only where there is no __getattr__
        return __import__("attitude.fixed", None, None, (name,))
    for row in _HOMES.split("\n"):
        if name in row.split(" ")[1:]:
            home = "attitude." + row.split(" ")[0]
            value = getattr(__import__(home, None, None, (name,)), name)
            globals()[name] = value
            return value
    raise AttributeError("attitude has no %s" % name)
