# SPDX-License-Identifier: MIT
"""How each filter is run over a recording: counts in, up vectors (n x 3, sensor axes) out."""

import numpy as np

from tools import recordings
from tools.recordings import ACCEL_G, GYRO_DPS
from tools.virtual.port import install_micropython

install_micropython()  # before anything of attitude.fixed

CHUNK = 500  # samples between two reports of progress
VQF_LEAD_S = 0.0025  # the best of 0 to 6 ms for its mean over six trials of BROAD


def accelerometer(rec, tick):
    """Gravity as the accelerometer alone sees it."""
    accel = rec.samples()[:, 3:]
    tick(len(rec))
    return accel / np.maximum(np.linalg.norm(accel, axis=1, keepdims=True), 1e-9)


def _per_axis(rec, tick, make):
    """Roll and pitch by one filter for each axis, fed with body rates as the papers do."""
    from attitude import accel_tilt_deg

    roll, pitch = make(), make()
    dt = 1.0 / rec.rate_hz
    angles = np.empty((len(rec), 2))
    for i, (gx, gy, _, ax, ay, az) in enumerate(_rows(rec, tick)):
        accel_roll, accel_pitch = accel_tilt_deg(ax, ay, az)
        if i == 0:
            roll.reset(accel_roll)
            pitch.reset(accel_pitch)
        angles[i] = roll.update(accel_roll, gx, dt), pitch.update(accel_pitch, gy, dt)
    return recordings.up_from_roll_pitch(angles[:, 0], angles[:, 1])


def _rows(rec, tick):
    for i, row in enumerate(rec.samples().tolist(), 1):
        if i % CHUNK == 0:
            tick(CHUNK)
        yield row
    tick(len(rec) % CHUNK)


def complementary(rec, tick):
    """Two of them, alpha 0.98 as at 100 Hz."""
    from attitude import Complementary

    return _per_axis(rec, tick, lambda: Complementary(alpha=0.98, rate_hz=100))


def kalman_tilt(rec, tick):
    """Two of them, paper 000's variances."""
    from attitude import KalmanTilt

    return _per_axis(rec, tick, KalmanTilt)


def attitude(rec, tick, **settings):
    """The float filter with its defaults."""
    from attitude import Attitude

    f = Attitude(rec.rate_hz, gyro_range_dps=GYRO_DPS, accel_range_g=ACCEL_G, **settings)
    dt = 1.0 / rec.rate_hz
    out = np.empty((len(rec), 3))
    for i, row in enumerate(_rows(rec, tick)):
        f.update(*row, dt)
        out[i] = f.gravity()
    return out


def attitude_unled(rec, tick):
    """The same without its lead: the angles of the sample's instant, not of now."""
    return attitude(rec, tick, lag_s=0.0)


def _fixed(rec, tick, kind):
    from array import array

    import attitude.fixed

    f = getattr(attitude.fixed, kind)(rate_hz=rec.rate_hz, gyro_dps=GYRO_DPS, accel_g=ACCEL_G)
    counts = array("h", [0] * 7)
    angles = np.empty((len(rec), 2))
    for i, row in enumerate(rec.counts().tolist(), 1):
        for j in range(7):
            counts[j] = row[j]
        f.update(counts)
        angles[i - 1] = f.roll_mdeg, f.pitch_mdeg
        if i % CHUNK == 0:
            tick(CHUNK)
    tick(len(rec) % CHUNK)
    return recordings.up_from_roll_pitch(angles[:, 0] / 1000, angles[:, 1] / 1000)


def fixed_kalman2(rec, tick):
    """The integer twin of two KalmanTilt, in checked viper."""
    return _fixed(rec, tick, "KalmanTilt2")


def fixed_attitude(rec, tick):
    """The integer twin of Attitude, in checked viper."""
    return _fixed(rec, tick, "Attitude")


def vqf(rec, tick):
    """Laidig and Seel's own code, real time, six axes, its defaults."""
    from vqf import VQF

    samples = rec.samples()
    gyro = np.ascontiguousarray(np.radians(samples[:, :3]))
    accel = np.ascontiguousarray(samples[:, 3:] * recordings.STANDARD_GRAVITY)
    quat = VQF(1.0 / rec.rate_hz).updateBatch(gyro, accel)["quat6D"]
    tick(len(rec))
    return recordings.up_from_quaternion(quat)


def vqf_led(rec, tick):
    """VQF turned on at the sample's rate by the lead that suits it best on these recordings.

    Their truth is some milliseconds ahead of the sensor; Attitude's lag_s makes up for that, so
    the comparison is fair only if VQF has a lead as well.
    """
    up = vqf(rec, tick)
    turn = np.radians(rec.samples()[:, :3]) * VQF_LEAD_S
    up = up + np.cross(up, turn)  # what points up, seen by a sensor turned on
    return up / np.linalg.norm(up, axis=1, keepdims=True)


FILTERS = {
    "accelerometer": accelerometer,
    "complementary": complementary,
    "kalman_tilt": kalman_tilt,
    "fixed.kalman2": fixed_kalman2,
    "attitude": attitude,
    "fixed.attitude": fixed_attitude,
    "attitude, no lead": attitude_unled,
    "vqf": vqf,
    "vqf, led 2.5 ms": vqf_led,
}
