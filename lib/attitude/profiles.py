# SPDX-License-Identifier: MIT
"""What the body does, as settings of Attitude: Attitude(250, **PROFILES["flying"]).

Of the float filter and of its integer twin alike.
"""

PROFILES = {
    # turned and shaken by hand, or worn: any motion, none of it lasting
    "hand-held": {},
    # on wheels or legs: it starts, brakes and turns for a second or a few
    "robot": {"most_dps": 0.1, "most_sigmas": 1.0},
    # carried by its own thrust: the accelerometer says level, whatever the attitude, for as long
    # as the air does not resist, so the gyro counts for longer; its bias is that of the rest
    "flying": {"tau_s": 20.0, "most_dps": 0.05, "most_sigmas": 1.0, "bias_tau_s": 180.0,
               "rest_shaken_g": 0.03},
    # in a vehicle: accelerations that last for many seconds
    "driving": {"most_dps": 0.1, "most_sigmas": 1.0, "top_speed_m_s": 60.0},
}
