# SPDX-License-Identifier: MIT
"""What the vibration table claims, at one speed."""

import pytest

from tools import vibration


@pytest.fixture(scope="module")
def errors():
    return vibration.shaken(6000, 3.5)


def test_a_filter_ahead_saves_the_kalman_filter(errors):
    assert errors["KalmanTilt2"] > 3.0
    assert errors["KalmanTilt2, LowPass 30 Hz"] < errors["KalmanTilt2"] / 5
    assert errors["KalmanTilt2, AdaptiveNotch"] < errors["KalmanTilt2"] / 3


def test_attitude_does_not_mind(errors):
    assert errors["accelerometer"] > 20
    assert errors["Attitude"] < 0.4
    assert errors["Attitude, AdaptiveNotch"] < 0.4
