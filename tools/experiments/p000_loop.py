# SPDX-License-Identifier: MIT
"""Paper 000's claim: filter and PID at 80 Hz or more, on the emulated RP2040."""

from tools.experiments import on_board
from tools.experiments.outcome import Outcome, Picture

WANTED_HZ = 80

PROGRAM = """
import machine
from mpu6050 import MPU6050
from attitude.lite import Kalman
from attitude import accel_tilt_deg
from control import PID
from attitude.fixed import KalmanTilt2
from control import fixed
i2c = machine.I2C(0, scl=machine.Pin(5), sda=machine.Pin(4), freq=400000)
imu = MPU6050(i2c)
kalman, pid = Kalman(), PID(2.0, 0.5, 0.1, 100)
kalman.setAngle(0.0)

def paper():
    imu.read()
    ax, ay, az = imu.accel_g()
    gx = imu.gyro_dps()[0]
    pid.update(-kalman.getAngle(accel_tilt_deg(ax, ay, az)[0], gx, 0.004), 0.004)

twin, whole = KalmanTilt2(rate_hz=250), fixed.PID(0.002, 0.0005, 0.0001, 100)

def integer():
    imu.read()
    twin.update(imu.counts)
    whole.update(-twin.roll_mdeg, imu.counts[4])

print([measure(paper), measure(integer), measure(imu.read)])
"""


def run(out, **_):
    """Time of one loop: float as in the paper, and in integers."""
    outcome = Outcome("Rate of filter and PID", "Paper 000: the PID loop needs 80 Hz or more")
    with on_board.board(seed=1) as pico:
        rows = on_board.run(pico, PROGRAM)
    names = (
        "burst, two-variable Kalman (one axis), PID: float",
        "burst, Kalman of both axes, PID: integer",
        "the burst alone",
    )
    outcome.header = ("on the emulated RP2040, 125 MHz", "us", "heap bytes", "possible Hz")
    for name, (us, used) in zip(names, rows, strict=True):
        outcome.rows.append((name, us, used, round(1e6 / us)))
    outcome.notes = ["The paper's board, an Arduino Uno, is said to run well over 80 Hz."]
    outcome.values = {"paper000_loop": {"float_us": rows[0][0], "integer_us": rows[1][0]}}
    picture = Picture("Possible rate of the loop", x_label="", height=3.2)
    labels = ("float", "integer", "burst alone")
    picture.axes[0].bar(labels, [1e6 / us for us, _ in rows], color=("0.3", "0.55", "0.8"),
                        label="measured")
    picture.axes[0].axhline(WANTED_HZ, color="k", linestyle="--", label="80 Hz")
    picture.save(outcome, out, "p000_loop", "Loops per second on the emulated board",
                 ["rate (Hz)"])
    return outcome
