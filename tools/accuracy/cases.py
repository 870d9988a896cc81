# SPDX-License-Identifier: MIT
"""Simulated cases that a filter should survive: recordings whose truth is known by their making.

CASES: {name: function of a seed that makes the tools.recordings.Recording}. A sensor's noise is
the datasheet's at 44 Hz of bandwidth, its ranges 2000 deg/s and 16 g.
"""

import numpy as np

from tools.accuracy.motions import G, Motion, begin
from tools.recordings import Recording

STILL_S = 6.0  # each case but the starts in motion begins at rest


def during(t, from_s, to_s, over_s=1.0):
    """0, between the two times 1, smooth at both ends."""
    return begin(t, from_s, over_s) * (1 - begin(t, to_s - over_s, over_s))


def hand(seed, still_s=STILL_S, fast=1.0):
    """(angles, push): turned by hand in all directions, and moved to and fro."""
    rng = np.random.default_rng(seed)
    hz, phase = rng.uniform(0.8, 1.2, 6) * fast, rng.uniform(0, 2 * np.pi, 6)

    def on(t):
        return begin(t, still_s, 2.0) if still_s else np.ones_like(t)

    def wave(t, n, omega):
        return np.sin(omega * hz[n] * (t - still_s) + phase[n])

    def angles(t):
        return [on(t) * deg * wave(t, n, omega)
                for n, (deg, omega) in enumerate(((50, 1.9), (35, 2.3), (70, 1.3)))]

    def push(t):
        return 0.03 / G * on(t)[:, None] * np.stack(
            [size * wave(t, n, omega) for n, size, omega in
             ((3, 30, 5.5), (4, 18, 4.3), (5, 25, 5.0))], 1)

    return angles, push


def gentle(seed, deg=(6, 4, 10)):
    """Angles of a body that sways a little."""
    rng = np.random.default_rng(seed)
    omega, phase = rng.uniform(0.6, 3.0, 3), rng.uniform(0, 2 * np.pi, 3)

    def angles(t):
        return [begin(t, STILL_S, 2.0) * d * np.sin(omega[n] * t + phase[n])
                for n, d in enumerate(deg)]

    return angles


def sensed(motion, from_s, told_hz=None, scale=1.0, bias=(0.0, 0.0, 0.0), seed=0, more=None):
    """The Recording; more: n x 6 that the sensor reads besides; errors count after from_s."""
    rows = motion.read(scale * np.eye(3), bias, seed=seed)
    if more is not None:
        rows = rows + more(motion.t)
    return Recording("simulated", told_hz or motion.rate_hz, G * rows[:, 3:],
                     np.radians(rows[:, :3]), motion.quat, motion.t >= from_s)


def ordinary(rate_hz, **wrong):
    """By hand for a minute; `wrong` as of sensed()."""
    return lambda seed: sensed(Motion(60, *hand(seed), rate_hz), STILL_S, seed=seed, **wrong)


def clock(seed):
    """The sensor's clock is 2 % fast, and nobody says so."""
    return sensed(Motion(60, *hand(seed), 255.0), STILL_S, told_hz=250.0, seed=seed)


def scale(seed):
    """Fast, with a gyro that is off by the datasheet's tolerance."""
    return sensed(Motion(60, *hand(seed, fast=1.6), 250.0), STILL_S, scale=1.03, seed=seed)


def start(bias, from_s, to_s):
    """Switched on in motion with this bias, deg/s."""
    def make(seed):
        return sensed(Motion(to_s, *hand(seed, 0.0), 250.0), from_s, bias=bias, seed=seed)

    return make


def turn(for_s):
    """A car's turn at 0.3 g: it pushes to the side that turns with the car."""
    def make(seed):
        sway = gentle(seed, (2, 2, 3))

        def angles(t):
            roll, pitch, yaw = sway(t)
            return roll, pitch, yaw + heading(t)

        def heading(t):
            return 20.0 * np.clip(t - 20, 0, for_s)

        def push(t):
            side = np.radians(heading(t))
            return 0.3 * during(t, 20, 20 + for_s)[:, None] * np.stack(
                [-np.sin(side), np.cos(side), 0 * t], 1)

        return sensed(Motion(for_s + 35, angles, push, 250.0), 20, seed=seed)

    return make


def pushed(size_g, pattern, seconds):
    """Along one line: pattern(t) times size_g."""
    def make(seed):
        def push(t):
            return np.stack([size_g * pattern(t), 0 * t, 0 * t], 1)

        return sensed(Motion(seconds, gentle(seed, (3, 2, 5)), push, 250.0), 10, seed=seed)

    return make


def stop_and_go(t):
    """5 s forward, 5 s of way, 5 s back."""
    phase = np.where(t > 10, (t - 10) % 20, 7)
    return 1.0 * (phase < 5) - 1.0 * ((phase >= 10) & (phase < 15))


def fall(seed):
    """Free fall for a second, a landing at 4 g."""
    def push(t):
        up = -1.0 * ((t >= 20) & (t < 21)) + 4.0 * ((t >= 21) & (t < 21.25))
        return np.stack([0 * t, 0 * t, up], 1)

    return sensed(Motion(35, gentle(seed, (20, 15, 30)), push, 250.0), 20, seed=seed)


def vibration(hz):
    """2 g that the low-pass lets through, sampled at 250 Hz."""
    def make(seed):
        phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, 3)

        def more(t):
            wave = 2 * np.sin(2 * np.pi * hz * t[:, None] + phase)
            return np.hstack([0 * wave, during(t, 10, 40)[:, None] * wave])

        motion = Motion(45, gentle(seed, (20, 15, 30)), None, 250.0)
        return sensed(motion, 10, seed=seed, more=more)

    return make


def spin(dps):
    """For five seconds about the vertical; above 2000 deg/s the gyro is over its range."""
    def turned(t):  # the integral of begin(t, 0, 1)
        u = np.clip(t, 0, 1)
        return u**3 - u**4 / 2 + np.maximum(t - 1, 0)

    def make(seed):
        sway = gentle(seed, (10, 8, 10))

        def angles(t):
            roll, pitch, yaw = sway(t)
            return roll, pitch, yaw + dps * (turned(t - 15) - turned(t - 19))

        return sensed(Motion(45, angles, None, 250.0), 15, seed=seed)

    return make


def unseen(seed):
    """30 degrees in 0.2 s of which the gyro tells nothing."""
    sway = gentle(seed, (15, 10, 20))

    def angles(t):
        roll, pitch, yaw = sway(t)
        return roll + 30 * np.clip((t - 20) / 0.2, 0, 1), pitch, yaw

    rec = sensed(Motion(60, angles, None, 250.0), 20, seed=seed)
    blind = slice(round(19.99 * 250), round(20.21 * 250))
    rec.gyro_dps[blind] = 0.0
    return rec


def rest(seed):
    """An hour at rest, while the bias drifts by 0.4 deg/s."""
    def more(t):
        return np.outer(t / 3600, (0.4, -0.3, 0.4, 0, 0, 0))

    motion = Motion(3600, lambda t: (0 * t, 0 * t, 0 * t), None, 80.0)
    return sensed(motion, 10, seed=seed, more=more)


def warms(seed):
    """Moved for twenty minutes without a rest, warmer by 15 degC at the end."""
    def more(t):
        return np.outer(t / 1200, (5, -4, 5, 0, 0, 0))

    return sensed(Motion(1200, *hand(seed), 80.0), STILL_S, seed=seed, more=more)


CASES = {
    "by hand, 80 Hz": ordinary(80.0),
    "by hand, 250 Hz": ordinary(250.0),
    "by hand, 1000 Hz": ordinary(1000.0),
    "clock 2 % fast": clock,
    "gyro scale 3 %, fast motion": scale,
    "start in motion, first 10 s": start((1.5, -1.0, 0.8), 0.0, 10.0),
    "start in motion, 10 to 65 s": start((1.5, -1.0, 0.8), 10.0, 65.0),
    "the same, bias 15 deg/s": start((15.0, -12.0, 9.0), 10.0, 65.0),
    "car's turn 0.3 g, 20 s": turn(20.0),
    "car's turn 0.3 g, 8 s": turn(8.0),
    "braking 0.3 g, 5 s": pushed(-0.3, lambda t: during(t, 20, 25, 0.3), 35),
    "stop and go 0.2 g": pushed(0.2, stop_and_go, 130),
    "free fall 1 s, landing 4 g": fall,
    "vibration 2 g, 80 Hz": vibration(80.0),
    "vibration 2 g, 249 Hz": vibration(249.0),
    "spin 1900 deg/s": spin(1900.0),
    "spin 2300 deg/s": spin(2300.0),
    "30 degrees unseen by the gyro": unseen,
    "an hour at rest, drifting": rest,
    "warms 15 degC in 20 minutes": warms,
}
