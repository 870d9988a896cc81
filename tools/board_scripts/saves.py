# SPDX-License-Identifier: MIT
# Runs on the board and on MicroPython's unix port (see host_tests/board/test_power_cut.py): saves
# numbered settings, calibrations and a short file with the firmware's own code, and tells which
# one is stored. Number 0 is what holds when nothing is stored.

from firmware import store
from firmware.config import Config


def _config(n):
    config = Config()
    if n:
        config.set("rate_hz", 100 + n)
        config.set("kalman_r_measure", n / 4)
    return config


def _calibration(n):
    """All fields in use, in numbers that are exact in every float."""
    from calibration import Calibration

    if not n:
        return Calibration()
    small = n / 64
    near_one = (1.0 + small, -small, small, small, 1.0 - small, -small, -small, small, 1.015625)
    return Calibration(
        gyro_bias_dps=(n + 0.015625, -n - 0.015625, 0.015625),
        accel_bias_g=(0.015625, -0.015625, 0.03125),
        gyro_matrix=near_one,
        accel_matrix=near_one,
        gyro_slope_dps_per_c=(0.015625, -0.015625, small),
        accel_slope_g_per_c=(0.0078125, -0.0078125, 0.0078125),
        residual_mg=1.015625,
        who_am_i=0x68,
        date="2026-03-01, made by a test, number %d" % n,
    )


def save(kind, n):
    """Save number n."""
    if kind == "config":
        _config(n).save()
    elif kind == "short":
        store.save("short.txt", kind, 1, {"n": n})
    else:
        from firmware import calibration as keeping

        keeping.save_calibration(_calibration(n))


def loaded(kind):
    """The number that is stored, 0 with none, None for what nobody saved; and the warnings."""
    if kind == "config":
        config = Config()
        warnings = config.load()
        n = config.rate_hz - 100 if config.rate_hz != 250 else 0
        same = config._values == _config(n)._values
    elif kind == "short":
        values, warnings = store.load("short.txt", kind, 1)
        n = values["n"] if values else 0
        same = True
    else:
        from firmware import calibration as keeping

        cal, warnings = keeping.load_calibration()
        n = int(cal.gyro_bias_dps[0])
        same = cal.to_dict() == _calibration(n).to_dict()
    return n if same else None, warnings
