# SPDX-License-Identifier: MIT
"""Hypothesis writes the files: no crash, no hang, a clear warning, the last good values.

PLUMB_FUZZ is the number of sets of files for each of the two kinds.
"""

import contextlib
import math
import os
import random
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from host_tests.firmware.hostile_files import (
    ENDS,
    KINDS,
    LIMITS,
    NAMES,
    ODD_COUNTS,
    ODD_NAMES,
    ODD_VALUES,
    OPERATIONS,
    check_warnings,
    chosen,
    good,
    mended,
    mutated,
    outcome,
    quick_folder,
    valid,
    whole,
    written,
)
from tools.virtual.port import Port

SETS = int(os.environ.get("PLUMB_FUZZ", "2000"))


@pytest.fixture
def port():
    with quick_folder() as folder, contextlib.chdir(folder), Port("rp2") as virtual:
        yield virtual


def put(files, kind):
    """Make the folder hold this set of files."""
    for end, data in zip(ENDS, files):
        path = kind + ".txt" + end
        if data is not None:
            with open(path, "wb") as f:
                f.write(data)
        elif os.path.exists(path):
            os.remove(path)


def load(kind):
    """(values as a dict, warnings) as the board's start reads them."""
    from firmware import calibration as keeping
    from firmware.config import KNOBS, Config

    if kind == "config":
        config = Config()
        warnings = config.load()
        return {row[0]: getattr(config, row[0]) for row in KNOBS}, warnings
    cal, warnings = keeping.load_calibration()
    return cal.to_dict(), warnings


def save(kind, seed):
    """Save some values; what a load must give now."""
    from calibration import Calibration

    from firmware import calibration as keeping
    from firmware.config import KNOBS, Config

    if kind == "config":
        config = Config()
        config.set("rate_hz", 80 + seed % 900)
        config.set("rest_s", (seed % 1000) / 128)
        config.save()
        return {row[0]: getattr(config, row[0]) for row in KNOBS}
    cal = Calibration(gyro_bias_dps=(seed % 79, -0.25, 1e-9), date=str(seed))
    keeping.save_calibration(cal)
    return cal.to_dict()


def hostile(kind):
    """Strategy: one file of every sort of damage, malice and accident."""
    texts = st.text(max_size=30)
    names = st.sampled_from(NAMES[kind] + ODD_NAMES) | texts
    numbers = st.integers().map(str) | st.floats().map(repr)
    several = st.lists(numbers | st.sampled_from(ODD_VALUES), min_size=3, max_size=9)
    values = st.sampled_from(ODD_VALUES) | numbers | texts | several.map(" ".join)
    rows = st.lists(st.tuples(names, values), max_size=6)
    counts = st.sampled_from(ODD_COUNTS)
    known = st.tuples(st.sampled_from(NAMES[kind]), values)
    saved = st.integers(0, 9999).map(lambda seed: good(kind, random.Random(seed)))
    anywhere = st.integers(0, 999)
    changes = st.tuples(st.sampled_from(OPERATIONS), anywhere, anywhere, st.binary(max_size=9))
    damaged = st.tuples(saved, st.lists(changes, min_size=1, max_size=3)).map(_damaged)
    return st.one_of(
        st.binary(max_size=300),
        st.sampled_from([b"", b"\n" * 4096, b"a\n" * 2048, b"x" * 4097, b"\xff" * 4096]),
        st.lists(texts, max_size=12).map(lambda lines: written("\n".join(lines) + "\n")),
        rows.map(lambda rows: whole(kind, 5, rows)),
        st.lists(known, min_size=1, max_size=3).map(lambda rows: whole(kind, 5, rows)),
        st.tuples(st.sampled_from(KINDS + ("", "x y")), counts, rows, counts).map(
            lambda parts: whole(*parts)
        ),
        st.integers(55, 70).map(lambda n: whole(kind, 5, [(f"q{i}", "1") for i in range(n)])),
        damaged,
        damaged.map(mended),
        saved,
    )


def _damaged(parts):
    data, changes = parts
    for change in changes:
        data = mutated(data, *change)
    return data


def sane(kind, values):
    """Assert that a board can work with these values."""
    from firmware.config import checked

    if kind == "config":
        for name, value in values.items():
            assert checked(name, value) == value
        return
    for name, limit in LIMITS.items():
        value = values[name]
        for number in value if isinstance(value, list) else [value]:
            assert number is None or (math.isfinite(number) and abs(number) <= limit)


@pytest.mark.parametrize("kind", KINDS)
def test_no_file_stops_the_boot(port, kind):
    counts = {"files": 0, "refused": 0, "sets": 0, "defaults": 0}
    file = hostile(kind)
    other = st.none() | file

    @settings(max_examples=SETS, deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.tuples(file, other, other), st.integers(0, 99999))
    def boots(files, seed):
        put(files, kind)
        began = time.process_time()
        values, warnings = load(kind)
        assert time.process_time() - began < 1
        expected, blamed = outcome(files, kind)
        assert values == expected
        sane(kind, values)
        check_warnings(files, kind, blamed, warnings)
        saved = save(kind, seed)
        assert load(kind) == (saved, [])
        present = [data for data in files if data is not None]
        counts["files"] += len(present)
        counts["refused"] += sum(not valid(data, kind) for data in present)
        counts["sets"] += 1
        counts["defaults"] += not chosen(files, kind)

    boots()
    print(
        "\n{}: {files} files in {sets} sets: {refused} refused, {} accepted, "
        "{defaults} sets without a good one, 0 exceptions".format(
            kind, counts["files"] - counts["refused"], **counts
        )
    )
    assert counts["refused"] > counts["files"] / 4
