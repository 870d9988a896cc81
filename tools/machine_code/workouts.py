# SPDX-License-Identifier: MIT
"""Programs for lib alone: filters get rest, motion and what no sensor should give, controllers
what no robot does, mathematics all where it is defined.
"""

import random
from array import array

LOW, HIGH = -32768, 32767


class Pwm:
    """What machine.PWM offers to motors and servos."""

    def __init__(self, pin=None, **_settings):
        self.hz = self.ns = self.u16 = 0

    def freq(self, hz):
        self.hz = hz

    def duty_ns(self, ns):
        self.ns = ns

    def duty_u16(self, u16):
        self.u16 = u16


class Skewed:
    """A calibration at the datasheet's worst, mounted askew."""

    gyro_bias_dps = (20.0, -20.0, 20.0)
    accel_bias_g = (0.08, -0.05, 0.08)
    gyro_matrix = accel_matrix = (-0.57, 0.02, 0.84, 0.84, 0.02, 0.59, 0.02, 1.03, -0.02)


def counts(rng, n):
    """n rows of ax ay az temp gx gy gz: rest, a turn, full scale in every way, noise."""
    rest = [[rng.randint(-3, 3), 40, 4096 + rng.randint(-3, 3), 0, 9, -9, 5] for _ in range(n)]
    turn = [[i % 4096, -i % 2048, 4096 - i % 4096, 0, 3 * i % 9000, -i, 900] for i in range(n)]
    spin = [[0, 0, 32700, 0, *[rng.choice((LOW + 20, HIGH - 20)) for _ in range(3)]]] * (n // 2)
    corners = [[rng.choice((LOW, HIGH, 0)) for _ in range(7)] for _ in range(n // 2)]
    noise = [[rng.randint(LOW, HIGH) for _ in range(7)] for _ in range(n // 2)]
    over = [[0, 0, LOW, 0, 0, 0, 0]] * n
    return rest + turn + rest + spin + corners + noise + over


def feed(filt, rows):
    words = array("h", [0] * 7)
    for row in rows:
        words[:] = array("h", row)
        filt.update(words)


def attitudes(port):
    """The filters of three axes, at their slowest and fastest, calibrated and not."""
    from attitude.fixed import Attitude, KalmanTilt2

    rng = random.Random(3)
    for make in (Attitude, KalmanTilt2):
        for rate_hz, gyro_dps, accel_g in ((80, 250, 2), (250, 500, 8), (1000, 2000, 16)):
            filt = make(rate_hz, gyro_dps, accel_g)
            feed(filt, counts(rng, 300))
            filt.calibrate(Skewed)
            filt.period_us = 1.04e6 / rate_hz
            filt.relevel()
            feed(filt, counts(rng, 120))
            words = array("h", [0, 0, 4096, 0, 50, -30, 20])
            for n in range(60):
                filt.update(words, 1000 * (n % 9 + 1))


def scalars(port):
    """The filters of one number, and those of the counts."""
    from attitude import fixed

    rng = random.Random(4)
    rows = counts(rng, 60)
    feed(fixed.LowPass(40, 1000), rows)
    feed(fixed.Notch(120, 1000, 0.5), rows)
    feed(fixed.AdaptiveNotch(40, 240, 1000, 20), rows)
    filters = fixed.Complementary(tau_s=0.5, rate_hz=250), fixed.Complementary(0.9, rate_hz=10)
    kalman, mean = fixed.Kalman1D(), fixed.MovingAverage(5)
    for row in rows:
        for filt in filters:
            filt.update(row[0] * 5, row[4] * 100)
        kalman.update(row[0] * 5, row[4])
        mean.update(row[0] * 100)


def control(port):
    """Controllers, mixer and motors."""
    from control import Escs, HBridge, Servo
    from control.fixed import PID, QuadControl

    rng = random.Random(5)
    escs = Escs([Pwm() for _ in range(4)])
    bridge, servo = HBridge(Pwm(), Pwm()), Servo(Pwm(), slew_dps=600.0)
    gains = [(1.5, 2.0, 0.02)] * 2 + [(3.0, 1.0, 0.0)]
    pids = [PID(2.0, 1.0, 0.1, 900), PID(-0.3, 0.0, 2.0, (0, 255), 1000, 4000, 0.01)]
    quad = QuadControl([6.0, 6.0, 3.0], gains)
    for n in range(300):
        wide = 10 ** rng.randint(1, 6)
        for pid in pids:
            pid.update(rng.randint(-wide, wide), rng.randint(-wide, wide))
        quad.target(*[rng.randint(-180000, 180000) for _ in range(3)])
        angles = array("i", [rng.randint(-180000, 180000) // (n % 7 + 1) for _ in range(3)])
        rates = array("h", [rng.randint(LOW, HIGH) // (n % 5 + 1) for _ in range(7)])
        quad.update(n * 4, angles, rates)
        if n == 100:
            escs.arm(0)
        escs.write(array("i", [rng.randint(-200, 1200) for _ in range(4)]))
        bridge.write(rng.randint(-1200, 1200))
        servo.write(rng.randint(-60000, 60000))
    bridge.stop()


def mathematics(port):
    """Integer functions where they are defined."""
    from attitude.fixed import intmath

    rng = random.Random(6)
    for n in range(400):
        size = 10 ** rng.randint(1, 4) * rng.randint(1, 6)
        x, y = rng.randint(-size, size), rng.randint(-size, size)
        intmath.atan2_mdeg(y, x * (n % 5 > 0))
        intmath.hypot(x, y)
        intmath.isqrt(rng.randrange(2 ** rng.randint(1, 31)) - 2)
        intmath.mul_q15(rng.randint(-(2**30), 2**30), rng.randint(-(2**15), 2**15))
