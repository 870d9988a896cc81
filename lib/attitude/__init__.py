# SPDX-License-Identifier: MIT
"""Attitude filters: float classes that read like their equations; integer twins in attitude.fixed.

A name is loaded from its own file when it is first asked for, so a board that runs one filter
holds one filter in RAM.
"""

_HOME = {
    "Attitude": "attitude",
    "Complementary": "complementary",
    "FloatAttitude": "from_counts",
    "FloatTilt": "from_counts",
    "Kalman1D": "kalman1d",
    "KalmanND": "kalman_nd",
    "KalmanTilt": "kalman_tilt",
    "MovingAverage": "moving_average",
    "GyroIntegral": "tilt",
    "accel_tilt_deg": "tilt",
    "tilt_asin_deg": "tilt",
    "tilt_atan_deg": "tilt",
    "tilt_two_axes_deg": "tilt",
    "wrap_deg": "tilt",
    "yaw_transfer_deg": "tilt",
}


def __getattr__(name):
    if name == "fixed":  # MicroPython looks for a submodule only where there is no __getattr__
        return __import__("attitude.fixed", None, None, (name,))
    home = _HOME.get(name)
    if home is None:
        raise AttributeError("attitude has no %s" % name)
    value = getattr(__import__("attitude." + home, None, None, (name,)), name)
    globals()[name] = value
    return value
