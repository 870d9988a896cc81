# SPDX-License-Identifier: MIT
"""How each filter is run over a recording: samples in, an Estimate out.

FILTERS: those of the recordings, with what makes up for the samples' age; SIMULATED: those of the
simulated cases, whose samples are of their instant.
"""

from array import array
from dataclasses import dataclass

import numpy as np

from tools import recordings
from tools.accuracy.motions import from_euler, product
from tools.recordings import ACCEL_G, GYRO_DPS
from tools.virtual.port import install_micropython

install_micropython()  # before anything of attitude.fixed

CHUNK = 500  # samples between two reports of progress
CLAIMS = 60  # samples between two looks at what it claims
VQF_LEAD_S = 0.0025  # the best of 0 to 6 ms for its mean over six trials of BROAD
CLIP = {"biasClip": 25.0, "biasSigmaInit": 3.0}  # of VQF, for biases as an MPU6050 has them
CALIBRATED = {"scale_sigma": 0.004}  # what is known of a gyro whose scale was calibrated


@dataclass
class Estimate:
    """up: (n x 3) unit vectors to the sky, sensor axes; quat: (n x 4) sensor to earth, or None of
    filters without yaw; sigma_deg: (n x 2) of tilt (each axis) and yaw as claimed, or None."""

    up: np.ndarray
    quat: np.ndarray | None = None
    sigma_deg: np.ndarray | None = None


def accelerometer(rec, tick):
    """Gravity as the accelerometer alone sees it."""
    accel = rec.samples()[:, 3:]
    tick(len(rec))
    return Estimate(accel / np.maximum(np.linalg.norm(accel, axis=1, keepdims=True), 1e-9))


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
    return Estimate(recordings.up_from_roll_pitch(angles[:, 0], angles[:, 1]))


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
    quat, sigma, claimed = np.empty((len(rec), 4)), np.empty((len(rec), 2)), None
    for i, row in enumerate(_rows(rec, tick)):
        f.update(*row, dt)
        if i % CLAIMS == 0:
            claimed = f.tilt_sigma_deg, f.yaw_sigma_deg
        quat[i], sigma[i] = f.quaternion(), claimed
    return Estimate(recordings.up_from_quaternion(quat), quat, sigma)


def attitude_half(rec, tick):
    """The same with no lead but half a sample, which VQF's rule of integration has as well."""
    return attitude(rec, tick, lag_s=0.5 / rec.rate_hz)


def _fixed(rec, tick, kind, **settings):
    import attitude.fixed

    settings.update(rate_hz=rec.rate_hz, gyro_dps=GYRO_DPS, accel_g=ACCEL_G)
    f = getattr(attitude.fixed, kind)(**settings)
    counts = array("h", [0] * 7)
    angles, sigma, claimed = np.empty((len(rec), 3)), np.empty((len(rec), 2)), None
    for i, row in enumerate(rec.counts().tolist()):
        for j in range(7):
            counts[j] = row[j]
        f.update(counts)
        if f.knows_yaw and i % CLAIMS == 0:
            claimed = f.tilt_sigma_deg, f.yaw_sigma_deg
        angles[i], sigma[i] = f.angles_mdeg, claimed
        if (i + 1) % CHUNK == 0:
            tick(CHUNK)
    tick(len(rec) % CHUNK)
    angles /= 1000
    up = recordings.up_from_roll_pitch(angles[:, 0], angles[:, 1])
    return Estimate(up, from_euler(*angles.T), sigma) if f.knows_yaw else Estimate(up)


def fixed_kalman2(rec, tick):
    """The integer twin of two KalmanTilt."""
    return _fixed(rec, tick, "KalmanTilt2")


def fixed_attitude(rec, tick, **settings):
    """The integer twin of Attitude, of whose gyro nobody knows anything."""
    return _fixed(rec, tick, "Attitude", **settings)


def fixed_calibrated(rec, tick):
    """The same with what it may believe of a gyro whose scale was calibrated."""
    return fixed_attitude(rec, tick, **CALIBRATED)


def fixed_now(rec, tick):
    """The same without a lead."""
    return fixed_attitude(rec, tick, lag_s=0.0)


def vqf(rec, tick, lead_s=0.0, **settings):
    """Laidig and Seel's own code, real time, six axes; turned on at the last rate by lead_s."""
    from vqf import VQF

    samples = rec.samples()
    gyro = np.ascontiguousarray(np.radians(samples[:, :3]))
    accel = np.ascontiguousarray(samples[:, 3:] * recordings.STANDARD_GRAVITY)
    quat = VQF(1.0 / rec.rate_hz, **settings).updateBatch(gyro, accel)["quat6D"]
    tick(len(rec))
    half = gyro * lead_s / 2
    quat = product(quat, np.column_stack([np.ones(len(rec)), half]))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    return Estimate(recordings.up_from_quaternion(quat), quat)


def vqf_led(rec, tick):
    """With the lead that suits it best on these recordings.

    Their truth is some milliseconds ahead of the sensor; Attitude's lag_s makes up for that, so
    the comparison is fair only if VQF has a lead as well.
    """
    return vqf(rec, tick, VQF_LEAD_S)


def vqf_now(rec, tick, **settings):
    """Without the half sample by which its rule of integration leads."""
    return vqf(rec, tick, -0.5 / rec.rate_hz, **settings)


def vqf_clip(rec, tick):
    """The same, its bias clip raised from 2 to 25 deg/s, its start sigma from 0.5 to 3."""
    return vqf_now(rec, tick, **CLIP)


FILTERS = {
    "accelerometer": accelerometer,
    "complementary": complementary,
    "kalman_tilt": kalman_tilt,
    "fixed.kalman2": fixed_kalman2,
    "attitude": attitude,
    "fixed.attitude": fixed_attitude,
    "fixed.attitude, calibrated": fixed_calibrated,
    "vqf, led 2.5 ms": vqf_led,
    "attitude, half a sample": attitude_half,
    "vqf": vqf,
}
SCALED = ("fixed.attitude", "fixed.attitude, calibrated", "vqf, led 2.5 ms")
SIMULATED = {"fixed.attitude": fixed_now, "vqf": vqf_now, "vqf, clip raised": vqf_clip,
             "fixed.kalman2": fixed_kalman2}
