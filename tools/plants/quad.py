# SPDX-License-Identifier: MIT
"""A quadcopter of the 330 mm class: rigid body, four motors with lag, drag, shaking motors.

    m v' = R (0, 0, sum T) - d v - m g z        I w' = r x T + drag torques - w x I w
    T = Tmax s^2,  s' = (u - s) / lag,  drag torque = -+ q T (against each motor's own sense)

0.8 kg; motors 113 mm from the x and y axes, 5 N each at full speed, 35 ms to follow, 15 mm of drag
torque per thrust; inertia 7.5, 7.5, 13 g m^2; air drag 0.25 N per m/s. Numbers of a usual frame
with 920 rpm/V motors and 8 inch propellers at 3 cells. On the ground it rests until it lifts.

The accelerometer of a thing that flies feels thrust and drag, not gravity: level and tilted look
the same until it moves. That is why its attitude must come from the gyro for seconds.
"""

import math

from tools.plants.plant import Plant, Pulses
from tools.virtual.motion import quaternions as quat

_G = 9.80665
_DEG = math.pi / 180
# x, y of each motor in arms and its sense seen from above (+1 clockwise); control.mixer's order
MOTORS = ((-1, -1, 1), (1, -1, -1), (-1, 1, -1), (1, 1, 1))


class Quad(Plant):
    """Four ESCs on the pins, 1000 to 2000 us."""

    MASS_KG = 0.8
    ARM_M = 0.113
    THRUST_N = 5.0
    LAG_S = 0.035
    TORQUE_M = 0.015
    INERTIA = (0.0075, 0.0075, 0.013)
    DRAG = 0.25
    FULL_RPM = 9000
    SHAKE_G = 0.25  # of one motor at full speed
    SHAKE_DPS = 4.0

    columns = ("roll_deg", "pitch_deg", "yaw_deg", "height_m", "m1", "m2", "m3", "m4")

    def __init__(self, port, pins):
        super().__init__()
        self._pulses = [Pulses(port, pin) for pin in pins]
        self._speed = [0.0] * 4  # of the motors, share of full
        self._turn = [0.0] * 4  # their angles, rad
        self._velocity = [0.0] * 3
        self._rate = [0.0] * 3
        self.height_m = 0.0

    def _step(self, t_s, dt_s):
        thrust, torque = self._motors(t_s, dt_s)
        q, m = self.quaternion, self.MASS_KG
        up = quat.gravity(q)
        push = [thrust * u for u in self._to_earth((0.0, 0.0, 1.0))]
        force = [push[k] - self.DRAG * self._velocity[k] for k in range(3)]
        if self.height_m <= 0.0 and force[2] < m * _G:  # on the ground
            self._velocity = [0.0] * 3
            self._rate = [0.0] * 3
            self.height_m = 0.0
            felt = list(up)
        else:
            felt = quat.to_sensor(q, *(f / m / _G for f in force))
            for k in range(3):
                self._velocity[k] += (force[k] / m - (_G if k == 2 else 0.0)) * dt_s
            self.height_m += self._velocity[2] * dt_s
            self._rotate(torque, dt_s)
        self.sample = self._shaken(felt)
        roll = math.atan2(up[1], up[2]) / _DEG
        pitch = math.atan2(-up[0], math.hypot(up[1], up[2])) / _DEG
        w, x, y, z = q
        yaw = math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)) / _DEG
        return roll, pitch, yaw, self.height_m, *self._speed

    def _motors(self, t_s, dt_s):
        total, torque = 0.0, [0.0, 0.0, 0.0]
        for k, (x, y, sense) in enumerate(MOTORS):
            wish = min(max((self._pulses[k].us(t_s) - 1000.0) / 1000.0, 0.0), 1.0)
            self._speed[k] += (wish - self._speed[k]) * dt_s / self.LAG_S
            self._turn[k] += self._speed[k] * self.FULL_RPM / 60 * 2 * math.pi * dt_s
            thrust = self.THRUST_N * self._speed[k] ** 2
            total += thrust
            torque[0] += y * self.ARM_M * thrust
            torque[1] -= x * self.ARM_M * thrust
            torque[2] += sense * self.TORQUE_M * thrust
        return total, torque

    def _rotate(self, torque, dt_s):
        (p, q, r), (ix, iy, iz) = self._rate, self.INERTIA
        self._rate[0] += (torque[0] - (iz - iy) * q * r) / ix * dt_s
        self._rate[1] += (torque[1] - (ix - iz) * p * r) / iy * dt_s
        self._rate[2] += (torque[2] - (iy - ix) * p * q) / iz * dt_s
        step = quat.from_rotation_vector(*(w * dt_s for w in self._rate))
        turned = quat.product(self.quaternion, step)
        size = math.sqrt(sum(c * c for c in turned))
        self.quaternion = tuple(c / size for c in turned)

    def _to_earth(self, vector):
        w, x, y, z = self.quaternion
        return quat.to_sensor((w, -x, -y, -z), *vector)

    def _shaken(self, felt):
        """Each motor's imbalance turns with it and grows with the square of its speed."""
        fx, fy, fz = felt
        gx, gy, gz = (w / _DEG for w in self._rate)
        for speed, turn in zip(self._speed, self._turn, strict=True):
            size = speed * speed
            c, s = math.cos(turn) * size, math.sin(turn) * size
            fx += self.SHAKE_G * c
            fy += self.SHAKE_G * s
            fz += 0.3 * self.SHAKE_G * s
            gx += self.SHAKE_DPS * s
            gy += self.SHAKE_DPS * c
        return fx, fy, fz, gx, gy, gz
