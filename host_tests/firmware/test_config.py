# SPDX-License-Identifier: MIT
"""Knobs and calibrations are checked and come back from their files."""

import pytest

from host_tests.firmware.hostile_files import written
from tools.virtual.port import Port


@pytest.fixture
def port(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Port("rp2") as virtual:
        yield virtual


# ---- knobs


def test_every_knob_has_a_sound_default_a_unit_and_a_text(port):
    from firmware import config, texts

    assert set(texts._MEANINGS) == {knob.name for knob in config.KNOBS}
    for name, default, unit, choices, low, high, text in config.KNOBS:
        assert config.checked(name, default) == default
        assert text and isinstance(unit, str)
        assert choices or low < high


def test_a_number_is_the_knobs_own_so_that_none_stays_among_its_callers_garbage(port):
    from firmware import config

    for knob in config.KNOBS:
        if isinstance(knob.default, float):
            for value in (knob.low, knob.high):
                kept = config.checked(knob.name, value)
                assert kept == value and kept is not value and type(kept) is float


@pytest.mark.parametrize(
    "name, value, allowed",
    [
        ("rate_hz", 79, "80 to 1000 Hz"),
        ("rate_hz", 250.5, "80 to 1000 Hz"),
        ("rate_hz", True, "80 to 1000 Hz"),
        ("rate_hz", "250", "80 to 1000 Hz"),
        ("gyro_dps", 300, "250, 500, 1000, 2000"),
        ("filter", "kalman", "attitude, kalman2"),
        ("kalman_r_measure", float("nan"), "0.0001 to 1000.0 deg"),
        ("kalman_r_measure", float("inf"), "0.0001 to 1000.0 deg"),
        ("telemetry_hz", -1, "0 to 100 Hz"),
        ("telemetry_format", "csv", "one of plain, serial-studio, teleplot, plotjuggler$"),
        ("no_such_knob", 1, "no knob no_such_knob"),
    ],
)
def test_a_wrong_value_is_refused_with_what_is_allowed(port, name, value, allowed):
    from firmware.config import Config

    config = Config()
    with pytest.raises(ValueError, match=allowed):
        config.set(name, value)
    assert config.rate_hz == 250


def test_saved_values_come_back_and_the_file_reads_like_text(port, tmp_path):
    from firmware.config import Config

    config = Config()
    assert config.load() == []  # no file is no warning
    config.set("rate_hz", 500)
    config.set("kalman_r_measure", 0.125)
    config.set("filter", "float.kalman")
    config.save()
    text = (tmp_path / "config.txt").read_text()
    assert text.startswith("plumb config version 1 generation 1\n")
    assert "\nrate_hz = 500\n" in text and "\nkalman_r_measure = 0.125\n" in text
    again = Config()
    assert again.load() == []
    assert (again.rate_hz, again.kalman_r_measure, again.filter) == (500, 0.125, "float.kalman")
    again.reset()
    assert again.rate_hz == 250


def test_a_value_out_of_range_in_a_valid_file_keeps_the_default_and_the_others(port, tmp_path):
    from firmware.config import Config

    body = "plumb config version 1 generation 4\naccel_g = 16\nrate_hz = 9000\nwhat = 1\n"
    (tmp_path / "config.txt").write_bytes(written(body))
    config = Config()
    warnings = config.load()
    assert (config.rate_hz, config.accel_g) == (250, 16)
    assert any("rate_hz" in w and "80 to 1000" in w for w in warnings)
    assert any("no knob what" in w for w in warnings)


# ---- calibration and filters


def test_a_calibration_is_stored_and_checked(port, tmp_path):
    from calibration import Calibration

    from firmware import calibration as keeping

    made = Calibration(
        gyro_bias_dps=(1.5, -2.25, 0.5),
        accel_bias_g=(0.01, -0.02, 0.03),
        residual_mg=1.5,
        who_am_i=0x68,
        date="2026-03-01",
        temp_c=31.0,
    )
    keeping.save_calibration(made)
    text = (tmp_path / "calibration.txt").read_text()
    assert "gyro_bias_dps = 1.5 -2.25 0.5\n" in text
    read, warnings = keeping.load_calibration()
    assert warnings == [] and read.to_dict() == made.to_dict()
    bad = "plumb calibration version 1 generation 9\ngyro_bias_dps = 1 2 500\n"
    (tmp_path / "calibration.txt").write_bytes(written(bad))
    read, warnings = keeping.load_calibration()
    assert read.gyro_bias_dps == (0.0, 0.0, 0.0)
    assert any("gyro_bias_dps" in w for w in warnings)


def test_the_filters_knobs_begin_at_the_filters_own_defaults(port):
    import inspect

    import attitude
    from attitude import fixed
    from attitude.fixed.attitude import coefficients
    from attitude.gyro_learning import GyroLearning

    from firmware.config import Config
    from firmware.filters import SETTINGS, lag_s

    config = Config()
    kinds = {
        "attitude": (coefficients.set_up,),
        "kalman2": (fixed.KalmanTilt2,),
        "float.attitude": (attitude.Attitude, GyroLearning),
        "float.kalman": (attitude.KalmanTilt,),
    }
    for name, functions in kinds.items():
        defaults = {}
        for function in functions:
            defaults.update(
                (p.name, p.default) for p in inspect.signature(function).parameters.values()
            )
        for knob, own in SETTINGS[name].items():
            assert getattr(config, knob) == defaults[own], (name, knob)

    class Imu:
        delay_s = 0.0048

    assert lag_s(config, Imu) == pytest.approx(0.0053)  # and half a sample of 1 kHz
