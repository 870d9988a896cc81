# SPDX-License-Identifier: MIT
"""Integer quadcopter mixer; the law, the motors and their signs are control.mixer's."""

from array import array

import micropython


@micropython.viper
def _mix(throttle: int, torque: ptr32, motors: ptr32) -> int:
    roll = int(torque[0])
    pitch = int(torque[1])
    yaw = int(torque[2])
    r = roll if roll >= 0 else 0 - roll
    p = pitch if pitch >= 0 else 0 - pitch
    saturated = 0
    if r + p > 500:
        roll = roll * 500 // (r + p)
        pitch = pitch * 500 // (r + p)
        r = roll if roll >= 0 else 0 - roll
        p = pitch if pitch >= 0 else 0 - pitch
        saturated = 1
    room = 500 - (r if r > p else p)
    if yaw > room:
        yaw = room
        saturated = 1
    elif yaw < 0 - room:
        yaw = 0 - room
        saturated = 1
    motors[0] = 0 - roll + pitch + yaw
    motors[1] = 0 - roll - pitch - yaw
    motors[2] = roll + pitch - yaw
    motors[3] = roll - pitch + yaw
    low = int(motors[0])
    high = low
    k = 1
    while k < 4:
        m = int(motors[k])
        if m < low:
            low = m
        if m > high:
            high = m
        k += 1
    if throttle + low < 0:
        throttle = 0 - low
    if throttle + high > 1000:
        throttle = 1000 - high
    k = 0
    while k < 4:
        m = int(motors[k]) + throttle
        motors[k] = 0 if m < 0 else (1000 if m > 1000 else m)
        k += 1
    return saturated


class QuadX:
    """Integer twin of control.QuadX in permille; torques beyond +-32767 are not allowed."""

    def __init__(self):
        self.motors = array("i", [0] * 4)
        self.saturated = False

    def update(self, throttle, torque):
        """Throttle 0..1000, torque an array 'i' of roll, pitch, yaw -> self.motors, 0..1000."""
        self.saturated = bool(_mix(throttle, torque, self.motors))
        return self.motors
