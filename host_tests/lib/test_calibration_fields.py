# SPDX-License-Identifier: MIT
"""A calibration as plain data: what a file may hold, and what it may not."""

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st


def test_a_calibration_survives_json():
    from calibration import Calibration

    cal = Calibration(
        gyro_bias_dps=(1.5, -2.25, 0.5), accel_bias_g=(0.08, -0.05, 0.01), temp_c=31.5,
        accel_matrix=(1.03, 0.02, -0.02, -0.02, 0.97, 0.02, 0.02, -0.02, 1.03),
        gyro_slope_dps_per_c=(0.1, 0, -0.1),
        residual_mg=0.4, who_am_i=0x70, date="2026-03-01",
    )  # fmt: skip
    again = Calibration.from_dict(json.loads(json.dumps(cal.to_dict())))
    assert again.__dict__ == cal.__dict__
    assert Calibration.from_dict({}).__dict__ == Calibration().__dict__


BAD = [
    ([], "not a dict"),
    ({"version": 2}, "version is not known"),
    ({"gyro_bias_dps": [1, 2]}, "gyro_bias_dps is not a list of 3"),
    ({"gyro_bias_dps": "abc"}, "gyro_bias_dps is not a list of 3"),
    ({"gyro_bias_dps": [1, 2, None]}, "gyro_bias_dps holds something that is no number"),
    ({"gyro_bias_dps": [1, 2, True]}, "gyro_bias_dps holds something that is no number"),
    ({"gyro_bias_dps": [1, 2, 81]}, r"gyro_bias_dps is beyond \+-80"),
    ({"gyro_bias_dps": [1, 2, math.nan]}, r"gyro_bias_dps is beyond \+-80"),
    ({"gyro_bias_dps": [1, 2, 10**400]}, r"gyro_bias_dps is beyond \+-80"),
    ({"accel_bias_g": [0, 0, -0.6]}, r"accel_bias_g is beyond \+-0.5"),
    ({"accel_matrix": [1, 0, 0, 0, 1, 0, 0, 0, -1]}, "accel_matrix turns space inside out"),
    ({"gyro_matrix": [1, 0, 0, 0, 1, 0, 1, 0, 0]}, "gyro_matrix turns space inside out"),
    ({"accel_slope_g_per_c": [1, 0, 0]}, "accel_slope_g_per_c is beyond"),
    ({"temp_c": math.inf}, "temp_c is beyond"),
    ({"who_am_i": "0x68"}, "who_am_i holds something that is no number"),
    ({"date": 5}, "date is not a text"),
    ({"gyro_bais_dps": [0, 0, 0]}, "unknown field gyro_bais_dps"),
]


@pytest.mark.parametrize("fields, why", BAD)
def test_bad_fields_are_named(fields, why):
    from calibration import Calibration

    with pytest.raises(ValueError, match=why):
        Calibration.from_dict(fields)


def test_but_knows_its_fields():
    from calibration import Calibration

    with pytest.raises(ValueError, match="has no gyro_bias"):
        Calibration().but(gyro_bias=(0, 0, 0))


_JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=9) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=12,
)
_NAMES = ["version", "temp_c", "residual_mg", "who_am_i", "date"]
_NAMES += ["gyro_bias_dps", "accel_bias_g", "gyro_matrix", "accel_matrix"]
_NAMES += ["gyro_slope_dps_per_c", "accel_slope_g_per_c"]


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(st.sampled_from(_NAMES), _JSON) | _JSON)
def test_whatever_a_file_holds(fields):
    """A usable calibration or a ValueError with text; nothing else, whatever comes."""
    from calibration import Calibration

    try:
        cal = Calibration.from_dict(fields)
    except ValueError as error:
        assert len(str(error)) > 10
    else:
        assert all(math.isfinite(v) for v in cal.apply((0, 0, 1), (1, 2, 3))[0])
