# SPDX-License-Identifier: MIT
"""Knobs are checked; files survive power cuts, damage, hostility and the future."""

import binascii
import errno
import os

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tools.virtual.port import Port


@pytest.fixture
def port(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Port("rp2") as virtual:
        yield virtual


def written(body):
    """A file's bytes with the CRC that belongs to them."""
    data = body.encode() if isinstance(body, str) else body
    return data + b"crc %08x\n" % binascii.crc32(data)


# ---- knobs


def test_every_knob_has_a_sound_default_a_unit_and_a_text(port):
    from firmware import config

    for name, default, unit, choices, low, high, text in config.KNOBS:
        assert config.checked(name, default) == default
        assert text and isinstance(unit, str)
        assert choices or low < high


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


# ---- files


def test_values_of_all_kinds_survive_the_file(port):
    from firmware import store

    values = {"a": 1, "b": -0.25, "c": "two words", "d": (1.0, 2.5, -3), "e": 1e-9}
    store.save("x.txt", "thing", 3, values)
    assert store.load("x.txt", "thing", 3) == (values, [])


@pytest.mark.parametrize(
    "data, cause",
    [
        (b"", "truncated"),
        (b"plumb thing version 1 generation 9\na = 7\n", "truncated"),
        (written("plumb thing version 1 generation 9\na = 7\n").replace(b"7", b"8"), "crc"),
        (written("plumb thing version 2 generation 9\na = 7\n"), "version 2 is newer"),
        (written("plumb other version 1 generation 9\na = 7\n"), "not a thing file"),
        (written("plumb thing version 1 generation x\na = 7\n"), "not a number"),
        (written("plumb thing version 1 generation 9\na\n"), "line without a value"),
        (written(b"plumb thing version 1 generation 9\na = \xff\n"), "byte 0xff"),
        (written("plumb thing version 1 generation 9\na = " + "7" * 300 + "\n"), "too long"),
        (b"x" * 5000, "larger than"),
    ],
)
def test_a_bad_file_is_named_and_the_last_good_one_used(port, tmp_path, data, cause):
    from firmware import store

    store.save("x.txt", "thing", 1, {"a": 1})
    store.save("x.txt", "thing", 1, {"a": 2})
    (tmp_path / "x.txt").write_bytes(data)
    values, warnings = store.load("x.txt", "thing", 1)
    assert values == {"a": 1}
    assert any(cause in w for w in warnings), warnings
    assert warnings[-1] == "x.txt: last good one used"
    (tmp_path / "x.txt.old").unlink()
    values, warnings = store.load("x.txt", "thing", 1)
    assert values is None and warnings[-1] == "x.txt: defaults used"
    store.save("x.txt", "thing", 1, {"a": 3})  # and the next save mends it
    assert store.load("x.txt", "thing", 1) == ({"a": 3}, [])


class PowerCut(Exception):
    """The power went."""


class Flash:
    """`open` and `os` of the store with a budget of bytes and directory changes until the cut."""

    def __init__(self, store, budget):
        self.budget = budget
        self.os, self.open = store.os, store.__builtins__["open"]
        self.ENOENT = errno.ENOENT

    def spend(self):
        if self.budget == 0:
            raise PowerCut
        self.budget -= 1

    def opened(self, name, mode):
        f = self.open(name, mode)
        return _CutFile(self, f) if "w" in mode else f

    def stat(self, name):
        return self.os.stat(name)

    def rename(self, old, new):
        self.spend()
        self.os.rename(old, new)

    def remove(self, name):
        self.spend()
        self.os.remove(name)


class _CutFile:
    def __init__(self, flash, f):
        self.flash, self.f = flash, f
        flash.spend()

    def write(self, data):
        for i in range(len(data)):
            self.flash.spend()
            self.f.write(data[i : i + 1])

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.f.close()


@pytest.mark.parametrize("generations", [0, 1, 2])
def test_a_power_cut_after_any_byte_leaves_the_old_or_the_new(port, tmp_path, generations):
    from firmware import store

    old, new = {"a": 1, "b": "old"}, {"a": 2, "b": "new"}
    cuts = 0
    while True:
        for leftover in tmp_path.iterdir():
            leftover.unlink()
        for _ in range(generations):
            store.save("x.txt", "thing", 1, old)
        flash = Flash(store, cuts)
        real = store.os
        store.os, store.open = flash, flash.opened
        try:
            store.save("x.txt", "thing", 1, new)
            finished = True
        except PowerCut:
            finished = False
        finally:
            store.os = real
            del store.open
        values, warnings = store.load("x.txt", "thing", 1)
        if finished:
            assert values == new
            break
        assert values == (old if generations else None) or values == new, cuts
        assert warnings == []
        store.save("x.txt", "thing", 1, {"a": 3})  # the remains of the cut are no obstacle
        assert store.load("x.txt", "thing", 1) == ({"a": 3}, [])
        cuts += 1
    assert cuts > 60  # it did cut at every byte


_LINES = st.lists(st.text(max_size=60), max_size=12).map("\n".join)
_HOSTILE = st.one_of(
    st.binary(max_size=300),
    _LINES.map(lambda text: written(text + "\n")),
    _LINES.map(lambda text: written("plumb config version 1 generation 5\n" + text + "\n")),
    st.tuples(
        st.sampled_from(["rate_hz", "filter", "kalman_r_measure", "accel_g", "rest_s"]),
        st.one_of(st.integers(), st.floats(), st.text(max_size=20)),
    ).map(lambda kv: written("plumb config version 1 generation 5\n%s = %s\n" % kv)),
)


@settings(
    max_examples=int(os.environ.get("PLUMB_FUZZ", "1000")),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(main=_HOSTILE)
def test_no_file_stops_the_boot(port, tmp_path, main):
    from firmware import startup
    from firmware.config import KNOBS, Config, checked

    (tmp_path / "config.txt").write_bytes(main)
    config = Config()
    warnings = config.load()
    for row in KNOBS:
        assert checked(row[0], getattr(config, row[0])) == getattr(config, row[0])
    if any(getattr(config, row[0]) != row[1] for row in KNOBS):
        return
    (tmp_path / "calibration.txt").write_bytes(main)
    cal, more = startup.load_calibration()
    assert cal.gyro_bias_dps == (0.0, 0.0, 0.0)
    assert all(isinstance(w, str) for w in warnings + more)
    assert more  # nothing of this is a calibration: it is said


def test_a_calibration_is_stored_and_checked(port, tmp_path):
    from mpu6050.calibration import Calibration

    from firmware import startup

    made = Calibration(
        gyro_bias_dps=(1.5, -2.25, 0.5),
        accel_bias_g=(0.01, -0.02, 0.03),
        residual_mg=1.5,
        who_am_i=0x68,
        date="2026-03-01",
        temp_c=31.0,
    )
    startup.save_calibration(made)
    text = (tmp_path / "calibration.txt").read_text()
    assert "gyro_bias_dps = 1.5 -2.25 0.5\n" in text
    read, warnings = startup.load_calibration()
    assert warnings == [] and read.to_dict() == made.to_dict()
    bad = "plumb calibration version 1 generation 9\ngyro_bias_dps = 1 2 500\n"
    (tmp_path / "calibration.txt").write_bytes(written(bad))
    read, warnings = startup.load_calibration()
    assert read.gyro_bias_dps == (0.0, 0.0, 0.0)
    assert any("gyro_bias_dps" in w for w in warnings)


def test_the_filters_knobs_begin_at_the_filters_own_defaults(port):
    import inspect

    import attitude
    from attitude import fixed
    from attitude.fixed import attitude_setup
    from attitude.gyro_bias import GyroBias

    from firmware.config import Config
    from firmware.filters import SETTINGS, lag_s

    config = Config()
    kinds = {
        "attitude": (attitude_setup.set_up,),
        "kalman2": (fixed.KalmanTilt2,),
        "float.attitude": (attitude.Attitude, GyroBias),
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
    assert lag_s(config) == pytest.approx(0.0053)  # 4.8 ms at 44 Hz and half a sample of 1 kHz
