# SPDX-License-Identifier: MIT
"""Every filter on the real firmware, in single precision: live results, settings, hand-over."""

import pytest

PROGRAM = """
from array import array
from attitude import Complementary, FloatAttitude, FloatTilt, KalmanTilt
from attitude.fixed import Attitude, KalmanTilt2
from calibration import Calibration, mounting
cal = Calibration().mounted(mounting.orientation("-x", "+z"))
MAKE = (
    Attitude,
    KalmanTilt2,
    FloatAttitude,
    lambda *a: FloatTilt(KalmanTilt, *a),
    lambda *a: FloatTilt(Complementary, *a),
)
# roll 30, turning about z at 20 deg/s; the sensor sits turned by half a turn about z
level = array("h", (0, -2048, 3547, 0, 0, 0, 0))
moving = array("h", (0, -2048, 3547, 0, 0, 0, 1310))
def run(i, n=40):
    f = MAKE[i](50, 500, 8)  # 50 Hz: the fewer samples
    f.calibrate(cal)
    for _ in range(n):
        f.update(level, 20000)
    return f
def errors(action):
    try:
        action()
        return None
    except ValueError as error:
        return str(error)
"""


@pytest.fixture(scope="module")
def board(pico):
    pico.exec(PROGRAM)
    return pico


@pytest.mark.parametrize("i", range(5))
def test_each_tells_and_can_be_tuned(board, i):
    code = f"""
f = run({i})
f.update(moving, 20000)
first = list(f.out)
f.prepare(cal, 20100, dict())
f.swap()
f.update(moving)
f.relevel()
f.update(moving)
print((first, list(f.angles_mdeg), list(f.rates_mdps), [round(b, 2) for b in f.bias_dps],
       f.period_us, errors(lambda: f.prepare(period_us=25000)),
       errors(lambda: f.prepare(settings=dict(colour=1))) is not None, f.timed))
"""
    first, angles, rates, bias, period, refused, named, timed = eval(board.exec(code))
    assert abs(first[0] - 30000) < 100 and abs(first[1]) < 300
    assert abs(first[5] - 20000) < 100
    assert abs(first[7] - 2048) < 3 and abs(first[8] - 3547) < 3  # of the robot, not the sensor
    assert abs(angles[0] - 30000) < 400
    assert abs(rates[2] - 20000) < 100
    assert max(map(abs, bias)) < 0.2
    assert period == 20100
    assert refused == "period_us 25000: must be 19000.0 to 21000.0 at this rate_hz"
    assert named
    assert timed == (i > 1)


@pytest.mark.parametrize("i", range(5))
def test_each_goes_on_from_all_others(board, i):
    code = f"""
for j in range(5):
    old = run(j, 20)
    f = MAKE[{i}](50, 500, 8)
    f.calibrate(cal)
    f.go_on_from(old, 0, 40.0)
    at_once = list(f.angles_mdeg)
    f.update(level, 20000)
    print((at_once, list(f.angles_mdeg)))
"""
    for line in board.exec(code, timeout_s=20).splitlines():
        for roll, pitch, yaw in eval(line):
            assert abs(roll - 30000) < 100 and abs(pitch) < 100
            assert abs(yaw - (40000 if i in (0, 2) else 0)) < 100
