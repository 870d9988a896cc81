# SPDX-License-Identifier: MIT
"""What looks like rest and is none: what the sensor said some time ago, and a moment of a slow
motion."""

import re
from math import asin, degrees, pi

import pytest

from host_tests.firmware.test_gaps import BOARDS, KINDS, Rig
from host_tests.lib.sensor_rig import rig as sensor_rig
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.motion import Sequence, Sinusoid, Still

BIAS = (2.0, -1.5, 1.0)  # deg/s, of the rig's chip
MOVING = Sequence((Still(roll_deg=-8.0), 1.0), (Sinusoid(8.0, 0.5, "roll", phase_deg=-90), 1e9))
STILL_AGAIN = Sequence(
    (Still(roll_deg=-8.0), 1.0), (Sinusoid(8.0, 0.5, "roll", phase_deg=-90), 8.0),
    (Still(roll_deg=-8.0), 1e9),
)  # fmt: skip
DLPF_HZ = (260, 184, 94, 44, 21, 10, 5)  # RM p. 13


def fault(rig, kind, for_s):
    rig.bus.faults.append(make(kind, at_s=rig.port.now_ns / 1e9, for_s=for_s, **KINDS[kind]))


@pytest.mark.parametrize("stored", [False, True], ids=["nothing stored", "stored"])
@pytest.mark.parametrize("rest_s", [0.0, 0.05, 0.5])
@pytest.mark.parametrize("for_s", [0.05, 0.15, 0.3, 1.0, 4.0])
def test_a_start_in_motion_while_the_data_stand_claims_nothing_wrong(
    for_s, rest_s, stored, tmp_path, capsys
):
    """Where the bias is known from before, the tilt is claimed in the end."""
    board = list(BOARDS)[round(100 * (for_s + rest_s)) % 3]
    for at_s in (1.8, 2.1):
        with Rig(board, MOVING, tmp_path, rest_s=rest_s) as rig:
            if stored:
                from calibration import Calibration

                from firmware.calibration import save_calibration

                save_calibration(Calibration(gyro_bias_dps=BIAS, who_am_i=0x68))
            rig.app.start()
            rig.until(at_s)
            rig.app.stop()
            fault(rig, "stuck_data", for_s)
            rig.port.run_ms(0.3 * for_s * 1000)
            refused = None
            try:
                rig.app.start()
            except OSError as error:
                refused = str(error)
                rig.port.run_ms(4000)
                rig.app.start()
            assert bool(refused) == (for_s == 4.0)
            if refused:
                assert re.search(r"the sensor sends no.*Tried \d times in 1\.\d s", refused, re.S)
            for _ in range(2500):
                rig.port.run_ms(1)
                assert not rig.claimed or rig.roll_error() < 3.0, at_s
            assert rig.claimed or not stored


@pytest.mark.parametrize("phase_s", [0.03, 0.1])
@pytest.mark.parametrize("kind", KINDS)
def test_an_outage_in_motion_is_no_rest(kind, phase_s, tmp_path, capsys):
    """For longer than a rest takes: the last rate would be the bias ever after."""
    board = list(BOARDS)[(list(KINDS).index(kind) + round(100 * phase_s)) % 3]
    with Rig(board, STILL_AGAIN, tmp_path, rest_s=0.1) as rig:
        rig.app.start()
        rig.until(4 + phase_s)
        fault(rig, kind, 4.5)
        for _ in range(105):
            rig.port.run_ms(100)
            bias_dps = rig.app.calibration.gyro_bias_dps
            assert max(abs(b - a) for b, a in zip(bias_dps, BIAS)) < 0.5
        rig.app.zero_yaw()
        rig.port.run_ms(100)
        assert rig.claimed and rig.roll_error() < 1.0


@pytest.mark.parametrize("still", [False, True], ids=["moving", "at rest"])
@pytest.mark.parametrize("dlpf_hz", DLPF_HZ)
def test_data_that_stand_are_no_rest(dlpf_hz, still):
    """Not for the REPL's calibration either."""
    motion = Still(5.0) if still else Sinusoid(4.0, 1 / pi, "roll")
    with sensor_rig("rp2", MPU6050Chip(motion, seed=5)) as r:
        from calibration.rest import NotStill, rest

        imu = r.sensor(dlpf_hz=dlpf_hz)
        r.wait_ms(500)
        r.fault("stuck_data")
        with pytest.raises(NotStill, match="again and again"):
            rest(imu, 0.05)


@pytest.mark.parametrize("ranges", [(250, 2), (2000, 16)], ids=str)
@pytest.mark.parametrize("sensor_hz", [32, 1000])
@pytest.mark.parametrize("dlpf_hz", DLPF_HZ)
def test_a_quiet_sensor_does_not_stand(dlpf_hz, sensor_hz, ranges, tmp_path, capsys):
    """At rest behind any low-pass, with the coarsest steps: it starts, and no burst is refused."""
    gyro_dps, accel_g = ranges
    with Rig(
        "hard", Still(10.0), tmp_path, rest_s=0.05, dlpf_hz=dlpf_hz, sensor_hz=sensor_hz,
        gyro_dps=gyro_dps, accel_g=accel_g,
    ) as rig:  # fmt: skip
        for _ in range(2):
            rig.app.start()
            rig.port.run_ms(1000)
            stats = rig.app.stats()
            assert rig.claimed and stats["predicted"] == 0 and stats.get("frozen", 0) == 0
        assert "not measured" not in capsys.readouterr().out


@pytest.mark.parametrize("rest_s", [0.01, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("swing_deg", [1.0, 2.0, 3.0, 5.0, 8.0, 20.0])
def test_a_moment_of_a_motion_is_no_rest_however_short_it_may_be(
    swing_deg, rest_s, tmp_path, capsys
):
    """Nothing is stored: a rate that stands for a bias has to be told from a turn."""
    board = list(BOARDS)[round(swing_deg) % 3]
    for phase_deg in range(-60, 300, 90):
        motion = Sinusoid(swing_deg, 0.5, "pitch", phase_deg=phase_deg)
        with Rig(board, motion, tmp_path, rest_s=rest_s) as rig:
            rig.app.start()
            for _ in range(150):
                rig.port.run_ms(10)
                assert not rig.claimed or pitch_error(rig) < 3.0, phase_deg
            rig.app.stop()
        for file in tmp_path.iterdir():
            file.unlink()


def pitch_error(rig):
    w, x, y, z = rig.chip.truth(rig.port.now_ns / 1e9)
    return abs(rig.app.pitch_deg - degrees(asin(2 * (w * y - z * x))))
