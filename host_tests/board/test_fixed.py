# SPDX-License-Identifier: MIT
"""The integer filters on the real firmware: the very bits of the PC, and no heap.

Two instruction sets: the emulated RP2040 (ARM Thumb) and MicroPython on 32-bit RISC-V, which is
the ESP32-C3's. The PC runs the same functions with every operation checked.
"""

import binascii
from array import array

import pytest
from attitude.fixed import AdaptiveNotch, Attitude, KalmanTilt2, LowPass

from host_tests.lib.fixed_inputs import KINDS, Skewed, adversarial, recorded
from tools.virtual import images
from tools.virtual.images import run_rv32
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040 import flash

EACH = 16  # samples of each adversarial kind; the emulated board takes 5 ms of a PC's for one
RATE_HZ = 2000 / 7

# A filter's numbers come from the PC, since coefficients made in single precision may differ in
# their last bit; that they agree is tested apart.
PROGRAM = """
import binascii, io
from array import array
from attitude.fixed import AdaptiveNotch, Attitude, KalmanTilt2, LowPass
def feed(filt, start, rows, out):
    for i in range(len(start)):
        filt._s[i] = start[i]
    counts = array("h", [0] * 7)
    crc = 0
    source = io.BytesIO(rows)
    while source.readinto(counts):
        filt.update(counts)
        crc = binascii.crc32(out(filt), crc)
    print("crc", crc, binascii.crc32(filt._s))
def angles(filt):
    return filt.angles_mdeg
def counts(filt):
    return filt.counts
"""
CASES = {
    "Attitude(2000 / 7, 2000, 16)": (Attitude(RATE_HZ, 2000, 16), "angles"),
    "Attitude(80, 250, 2)": (Attitude(80, 250, 2), "angles"),
    "KalmanTilt2(2000 / 7, 2000, 16)": (KalmanTilt2(RATE_HZ, 2000, 16, trust_g=0.5), "angles"),
    "LowPass(44, 1000)": (LowPass(44, 1000), "counts"),
    "AdaptiveNotch(50, 200, 1000)": (AdaptiveNotch(50, 200, 1000, 4, 500.0), "counts"),
}


@pytest.fixture(scope="module")
def rows():
    """Motion from the first sample on, then everything absurd; 14 bytes a row."""
    samples, _ = recorded("21_undisturbed_fast_combined", 22, 0.6)
    for kind in KINDS:
        samples = samples + adversarial(kind, EACH, seed=9)
    return array("h", [value for row in samples for value in row]).tobytes()


@pytest.fixture(scope="module")
def pico(rows):
    with VirtualPico(root=True, main=False, files={"/rows.bin": rows}) as board:
        board.exec(PROGRAM + "rows = open('/rows.bin', 'rb').read()\n")
        yield board


def on_host(filt, rows, out):
    start, crc, counts = array("i", filt._s), 0, array("h", [0] * 7)
    for n in range(0, len(rows), 14):
        counts[:] = array("h", rows[n : n + 14])
        filt.update(counts)
        crc = binascii.crc32(filt.angles_mdeg if out == "angles" else filt.counts, crc)
    return list(start), "crc %d %d\n" % (crc, binascii.crc32(filt._s))


@pytest.fixture(scope="module")
def expected(rows):
    """{case: (numbers to start with, what the board must print)}."""
    for filt, out in CASES.values():
        if out == "angles":
            filt.calibrate(Skewed)
    return {case: on_host(*CASES[case][:1], rows, CASES[case][1]) for case in CASES}


@pytest.mark.parametrize("case", CASES)
def test_the_pico_gives_the_bits_of_the_pc(pico, expected, case):
    start, printed = expected[case]
    program = f"feed({case}, {start}, rows, {CASES[case][1]})"
    assert pico.exec(program, timeout_s=10) == printed


def library():
    files = flash.project_files(main=False)
    return {path[4:]: text for path, text in files.items() if path.startswith("lib/attitude/")}


def test_risc_v_gives_the_bits_of_the_pc(expected, rows):
    script = PROGRAM + "rows = %r\n" % rows
    for case, (start, _) in expected.items():
        script += f"feed({case}, {start}, rows, {CASES[case][1]})\n"
    assert run_rv32(library(), script) == "".join(printed for _, printed in expected.values())


@pytest.mark.parametrize("case", ["Attitude(250, 500, 8)", "KalmanTilt2(250, 500, 8)"])
def test_the_board_makes_the_same_coefficients(pico, case):
    filt = eval(case)
    board = pico.exec(f"f = {case}\nprint(list(f._s))")
    for here, there in zip(filt._s, eval(board), strict=True):
        assert abs(here - there) <= max(20, abs(here) * 3e-5)


def test_neither_a_step_nor_reading_it_touches_the_heap(pico):
    printed = pico.exec(
        """
import micropython, gc
from attitude.fixed import Complementary, Kalman1D, MovingAverage, Notch
c = array("h", (-300, 210, 4090, -3000, 250, -130, 75))
made = [Attitude(), KalmanTilt2(), Notch(60, 250), AdaptiveNotch(20, 60, 250)]
attitudes = made[:2]
others = [Complementary(tau_s=0.5), Kalman1D()]
mean = MovingAverage(5)
def work():
    for f in made:
        for _ in range(12):
            f.update(c)
    for f in attitudes:
        f.roll_mdeg
        f.pitch_mdeg
        f.angles_mdeg[1]
        f.rates_mdps[2]
        f.out[9]
        f.update(c, 4000)
        f.update(c, 33000)
        f.update(c, 2000000)
        f.step(c)
        f.period_us = 4004
        f.prepare(None, 3996)
        f.pending[-1] |= 1
        f.swap()
        f.relevel()
        f.yaw_mdeg
        f.at_rest
    for f in others:
        f.update(1234, 56)
    mean.update(99)
work()
gc.collect()
before = gc.mem_alloc()
micropython.heap_lock()
try:
    work()
finally:
    micropython.heap_unlock()
print(gc.mem_alloc() - before)
"""
    )
    assert printed == "0\n"


REST = """
from array import array
from attitude.fixed import Attitude
f = Attitude(50)  # the lowest rate is the soonest done
c = array("h", [300, -200, 4080, 0, 196, -196, 196])
# sums of four uniform numbers: 0.04 deg/s and 3.3 mg RMS, the datasheet's noise at 44 Hz
seed = 1
def noise(width):
    global seed
    total = 0
    for _ in range(4):
        seed = (seed * 1103 + 12345) & 0xFFFFF
        total += (seed >> 4) % width
    return total - 2 * (width - 1)
low = high = start = None
yaw = f.angles_mdeg
for n in range(50 * 600):
    c[0] = 300 + noise(24)
    c[1] = -200 + noise(24)
    c[2] = 4080 + noise(24)
    c[4] = 196 + noise(5)
    c[5] = -196 + noise(5)
    c[6] = 196 + noise(5)
    f.update(c)
    if n == 500:
        low = high = start = yaw[2]
    elif n > 500:
        low = min(low, yaw[2])
        high = max(high, yaw[2])
print(yaw[2] - start, high - low)
"""


def test_yaw_stands_still_for_ten_minutes_at_rest():
    """3 deg/s of bias on each axis, noise; once still for 10 s."""
    drift, span = map(int, run_rv32(library(), REST, timeout_s=120).split())
    assert abs(drift) < 100
    assert span < 200


HARD = """
import machine, micropython, time
from array import array
from attitude.fixed import Attitude, KalmanTilt2
micropython.alloc_emergency_exception_buf(200)
c = array("h", (-300, 210, 4090, -3000, 250, -130, 75))
done = array("i", [0, 0])
def ticker(f):
    @micropython.native
    def tick(_, step=f.step, update=f.update, swap=f.swap, relevel=f.relevel, done=done, c=c):
        try:
            step(c)
            update(c, 9000)
            if done[0] % 5 == 0:
                swap()
            if done[0] % 17 == 0:
                relevel()
            done[0] += 1
        except BaseException:
            done[1] += 1
    return tick
for f in (Attitude(), KalmanTilt2()):
    done[0] = done[1] = 0
    timer = machine.Timer(-1, freq=500, callback=ticker(f), hard=True)
    end = time.ticks_add(time.ticks_ms(), 200)
    junk = []
    while time.ticks_diff(end, time.ticks_ms()) > 0:  # the heap is busy, and collected
        junk = [n * 1.5 for n in range(50)]
        f.prepare(None, 3990)
        gc.collect()
    timer.deinit()
    print(done[0] > 90, done[1], len(f.state()) > 20)
"""


def test_a_hard_interrupt_can_run_all_that_a_tick_needs():
    image = images.rp2040_image("1.26.1")
    with VirtualPico(root=True, main=False, image=image) as board:
        assert board.exec("import gc\n" + HARD, timeout_s=20) == "True 0 True\n" * 2
