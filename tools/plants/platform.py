# SPDX-License-Identifier: MIT
"""The stabilised platform of paper 002: two servos in a gimbal, the sensor on the top plate.

    top = base * Rx(roll servo) * Ry(pitch servo)          (rotations, base moved from outside)

A servo is a standard size one of 0.2 s per 60 degrees (300 deg/s): it takes a pulse every 20 ms,
its own loop closes the way with a time constant of 20 ms, within its speed and acceleration,
with a dead band of 0.2 degrees and a gain that is off by some percent from what the program
believes. The plate is light against the servo's 1 N m, so it follows the gears.
The sensor's rate comes from the difference of two attitudes of the plate; its force is gravity
and, at arm_m from the gimbal's centre, the plate's own acceleration.
"""

import math

import numpy as np

from tools.plants.plant import Plant, Pulses
from tools.virtual.motion import quaternions as quat

_DEG = math.pi / 180


class ServoMotor:
    """A hobby servo: `step(pulse_us, dt_s)` moves angle_deg; 1000..2000 us are -45..45 degrees."""

    def __init__(self, gain=1.0, speed_dps=300.0, lag_s=0.02, dead_band_deg=0.2):
        self.angle_deg = 0.0
        self.rate_dps = 0.0
        self._gain = gain
        self._speed = speed_dps
        self._lag = lag_s
        self._dead = dead_band_deg
        self._push = speed_dps / 0.02  # full speed in 20 ms

    def step(self, pulse_us, dt_s):
        """No pulse: it lets go, and friction holds it where it is."""
        wish = 0.0
        if pulse_us:
            miss = (pulse_us - 1500.0) * 0.09 * self._gain - self.angle_deg
            if abs(miss) > self._dead:
                wish = min(max(miss / self._lag, -self._speed), self._speed)
        change = min(max(wish - self.rate_dps, -self._push * dt_s), self._push * dt_s)
        self.rate_dps += change
        self.angle_deg += self.rate_dps * dt_s


class Base:
    """What the base does: +-15 degrees at 0.5 Hz on both axes after a rest, and a knock of 20
    degrees on roll, there and back in half a second."""

    def __init__(self, amplitude_deg=15.0, frequency_hz=0.5, knock_deg=20.0, knock_s=0.5,
                 rest_s=2.0, knock_at_s=9.0):
        self._a, self._w = amplitude_deg, 2 * math.pi * frequency_hz
        self._knock = (knock_deg, knock_s, knock_at_s)
        self._rest = rest_s

    def angles(self, t_s):
        """(roll, pitch) in degrees."""
        t = t_s - self._rest
        if t <= 0:
            return 0.0, 0.0
        grow = min(1.0, t / 2)  # no jump of the rate at the start
        grow *= grow * (3 - 2 * grow)
        roll = self._a * grow * math.sin(self._w * t)
        pitch = self._a * grow * math.sin(self._w * t + 1.0)
        size, length, at = self._knock
        since = t_s - at
        if 0 < since < length:
            roll += size * (1 - math.cos(2 * math.pi * since / length)) / 2
        return roll, pitch


class Platform(Plant):
    """Base, two servos on `pins` (roll, pitch) of the Port, plate with the sensor."""

    columns = ("base_roll", "base_pitch", "servo_roll", "servo_pitch", "top_roll", "top_pitch")

    def __init__(self, port, pins, base=None, gain=(1.04, 0.97), arm_m=0.03):
        super().__init__()
        self._base = base or Base()
        self._pulses = [Pulses(port, pin) for pin in pins[:2]]
        self._servos = [ServoMotor(g) for g in gain]
        self._arm = np.array([0.0, 0.0, arm_m])
        self._places = [np.zeros(3)] * 2

    def _step(self, t_s, dt_s):
        for servo, pulses in zip(self._servos, self._pulses, strict=True):
            servo.step(pulses.us(t_s), dt_s)
        roll, pitch = self._base.angles(t_s)
        a, b = (s.angle_deg for s in self._servos)
        base = quat.from_euler(roll, pitch)
        top = quat.product(base, quat.product(_about(0, a), _about(1, b)))
        before = self.quaternion
        self.quaternion = top
        turn = quat.product(_back(before), top)
        rates = [2 * math.copysign(1.0, turn[0]) * v / dt_s / _DEG for v in turn[1:]]
        place = np.array(quat.to_sensor(_back(top), *self._arm))
        pull = (place - 2 * self._places[1] + self._places[0]) / dt_s**2 / 9.80665
        self._places = [self._places[1], place]
        if self._n < 3:
            pull = np.zeros(3)
        force = quat.to_sensor(top, pull[0], pull[1], pull[2] + 1.0)
        self.sample = (*(float(f) for f in force), *rates)
        up = quat.gravity(top)
        top_roll = math.atan2(up[1], up[2]) / _DEG
        top_pitch = math.atan2(-up[0], math.hypot(up[1], up[2])) / _DEG
        return roll, pitch, a, b, top_roll, top_pitch


def _back(q):
    return q[0], -q[1], -q[2], -q[3]


def _about(axis, angle_deg):
    half = angle_deg * _DEG / 2
    q = [math.cos(half), 0.0, 0.0, 0.0]
    q[axis + 1] = math.sin(half)
    return tuple(q)
