# SPDX-License-Identifier: MIT
"""Quadcopter mixer for the X frame."""

# Seen from above, x forward and y left; positive roll lifts the left side, positive pitch lowers
# the nose, positive yaw turns left. A propeller's drag turns the frame against its own sense.
#         roll pitch yaw
MOTORS = (
    (-1, 1, 1),  # 1 rear right, clockwise
    (-1, -1, -1),  # 2 front right, counter-clockwise
    (1, 1, -1),  # 3 rear left, counter-clockwise
    (1, -1, 1),  # 4 front left, clockwise
)


class QuadX:
    """Throttle and three torques to four motor commands, each within [0, 1].

    When they do not fit: attitude first. Yaw gives way before roll and pitch, these are scaled
    together so that the torque keeps its direction, and the throttle is shifted until all
    motors are in range, so that control remains at full and at no throttle.
    """

    def __init__(self):
        self.motors = [0.0, 0.0, 0.0, 0.0]
        self.saturated = False

    def update(self, throttle, roll, pitch, yaw):
        """Throttle 0..1 and torques in the same unit -> self.motors, in the order of MOTORS."""
        span = 2.0 * (abs(roll) + abs(pitch))
        scale = 1.0 if span <= 1.0 else 1.0 / span
        roll *= scale
        pitch *= scale
        # yaw loads the motors that roll and pitch leave alone: this much fits beside them
        room = 0.5 - max(abs(roll), abs(pitch))
        twist = min(max(yaw, -room), room)
        self.saturated = scale < 1.0 or twist != yaw
        motors = self.motors
        for k, (r, p, y) in enumerate(MOTORS):
            motors[k] = r * roll + p * pitch + y * twist
        base = min(max(throttle, -min(motors)), 1.0 - max(motors))
        for k in range(4):
            motors[k] = min(max(motors[k] + base, 0.0), 1.0)
        return motors
