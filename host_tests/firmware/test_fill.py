# SPDX-License-Identifier: MIT
"""One table of fill patterns, held against the tick's judge and the driver's plausible()."""

import random
from array import array

import pytest

from tools.virtual import Bus, MPU6050Chip, Port

REST = (30, -20, 4090, -3900, 130, -100, 66)
ZERO = (30, -20, 4090, 0, 2, -1, 0)  # a clone with a small bias, at the zero of its temperature
FAST = (900, -800, 3500, -3900, 9000, -7000, 3000)

# what comes, what came before; a fill to the judge, to the driver, who does not know what was
PATTERNS = [
    *[((fill,) * 7, before, True, True) for fill in (0, -1, -258, 4711, 257, -32768)
      for before in (REST, ZERO, FAST, None)],
    *[((*REST[:good], *[-258] * (7 - good)), before, True, True) for good in range(4)
      for before in (REST, ZERO, FAST, None)],
    *[((*REST[:good], *[fill] * (7 - good)), before, True, False) for good in range(1, 4)
      for fill in (0, -1) for before in (REST, FAST)],
    ((*ZERO[:3], 0, 0, 0, 0), ZERO, False, False),
    ((*ZERO[:3], -1, -1, -1, -1), ZERO, False, False),
    ((*ZERO[:3], 3, 3, 3, 3), ZERO, False, False),
    ((*ZERO[:3], 0, 0, 0, 0), None, False, False),
    (REST, REST, False, False), (FAST, FAST, False, False), (ZERO, ZERO, False, False),
]  # fmt: skip


@pytest.fixture
def port(tmp_path):
    with Port("rp2", {0: Bus(MPU6050Chip(seed=2))}, root=tmp_path) as virtual:
        yield virtual


@pytest.mark.parametrize("burst, before, filled, told", PATTERNS)
def test_the_judge_and_the_driver_know_the_same_patterns(port, burst, before, filled, told):
    from firmware.tick import judge

    words, chance = judge.memory(), random.Random(4)
    judge.allow(words, 10)
    for _ in range(3 if before else 0):
        varied = array("h", [value + chance.randrange(-3, 4) for value in before])
        assert judge.judge(varied, words) == 0
    assert (judge.judge(array("h", burst), words) == judge.FILL) is filled
    import machine
    from mpu6050 import MPU6050

    imu = MPU6050(machine.I2C(0, scl=machine.Pin(5), sda=machine.Pin(4)))
    for i in range(7):
        imu.counts[i] = burst[i]
    assert imu.plausible() is not told


class At:
    """At rest at a temperature."""

    duration_s = None

    def __init__(self, temp_c, force):
        self.sample = (*force, 0.0, 0.0, 0.0, temp_c)

    def at(self, _t_s):
        return self.sample

    def truth(self, _t_s):
        return (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("profile, zero_c, lsb", [
    ("MPU6050", 36.53, 340.0), ("MPU6500", 21.0, 333.87), ("ICM20689", 25.0, 326.8),
])  # fmt: skip
@pytest.mark.parametrize("counts", [0, -1])
@pytest.mark.parametrize("gyro_dps, dlpf_hz", [(500, 44), (2000, 5), (250, 184)])
@pytest.mark.parametrize("force", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
def test_a_healthy_part_at_its_temperatures_zero_is_no_fault(
    tmp_path, profile, zero_c, lsb, counts, gyro_dps, dlpf_hz, force
):
    bias_dps = (counts * gyro_dps / 32768,) * 3
    motion = At(zero_c + counts / lsb, force)
    chip = MPU6050Chip(motion, profile=profile, seed=2, gyro_bias_dps=bias_dps)
    with Port("rp2", {0: Bus(chip)}, root=tmp_path) as port:
        from firmware.app import App

        app = App()
        for name, value in (("gyro_dps", gyro_dps), ("dlpf_hz", dlpf_hz), ("rest_s", 0.1)):
            app.config.set(name, value)
        app.start()
        equal = []
        read = app.imu.counts
        app.outputs.add(lambda app: equal.append(read[3] == read[4] == read[5] == read[6]))
        port.run_ms(4000)
        stats = app.stats()
    assert stats.get("fill", 0) == stats["predicted"] == 0
    if gyro_dps == 2000:
        assert sum(equal) > 10  # so that it was asked
