# SPDX-License-Identifier: MIT
"""What notch, low-pass and adaptive trust buy when motors shake the sensor.

    python -m tools.vibration [--json FILE] [--seconds S]

A frame tilts +-15 degrees at 0.5 Hz while a motor shakes it, 1 g and 10 deg/s on each axis with
two harmonics. The virtual chip samples at 1 kHz with its filter open (184 Hz), as flight
controllers do for the sake of delay. RMS error of roll and pitch together, degrees.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from tools.recordings import roll_pitch_deg, up_from_quaternion
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Vibration
from tools.virtual.motion.one_axis import Sinusoid
from tools.virtual.port import Port

RPM = (3000, 4500, 6000, 9000, 12000)
RATE_HZ = 1000
SETTLE_S = 2.0  # start-up, which is not what is compared


class Chain:
    """A filter behind others that hand their counts on."""

    def __init__(self, filt, *ahead):
        self.filt, self.ahead = filt, ahead

    def update(self, counts):
        for stage in self.ahead:
            stage.update(counts)
            counts = stage.counts
        self.filt.update(counts)
        return self.filt.roll_mdeg / 1000, self.filt.pitch_mdeg / 1000


class Accelerometer:
    """The angles of the acceleration alone."""

    def update(self, counts):
        roll, pitch = roll_pitch_deg([counts[:3]])
        return roll[0], pitch[0]


def chains():
    from attitude.fixed import AdaptiveNotch, Attitude, KalmanTilt2, LowPass

    def kalman(**settings):
        return KalmanTilt2(RATE_HZ, **settings)

    def notch():
        return AdaptiveNotch(35, 240, RATE_HZ, slew_hz_s=200.0)

    return {
        "accelerometer": Accelerometer(),
        "KalmanTilt2": Chain(kalman()),
        "KalmanTilt2, trust_g=0.5": Chain(kalman(trust_g=0.5)),
        "KalmanTilt2, LowPass 30 Hz": Chain(kalman(), LowPass(30, RATE_HZ)),
        "KalmanTilt2, AdaptiveNotch": Chain(kalman(), notch()),
        "KalmanTilt2, notch and trust": Chain(kalman(trust_g=0.5), notch()),
        "Attitude": Chain(Attitude(RATE_HZ)),
        "Attitude, AdaptiveNotch": Chain(Attitude(RATE_HZ), notch()),
    }


def shaken(rpm, seconds):
    """{chain: RMS error in degrees} at one speed of the motor."""
    motion = Vibration(
        rpm, (1.0, 1.0, 1.0), (10.0, 10.0, 10.0), Sinusoid(15.0, 0.5)
    )
    with Port("rp2", buses={0: Bus(MPU6050Chip(motion=motion, seed=2))}) as port:
        import machine
        from mpu6050 import MPU6050

        imu = MPU6050(machine.I2C(0, freq=400_000), dlpf_hz=184, rate_hz=RATE_HZ)
        every = chains()
        angles, times = {name: [] for name in every}, []
        next_ns = port.now_ns
        for _ in range(int(seconds * RATE_HZ)):
            next_ns += 1_000_000_000 // RATE_HZ
            port.run_ms(max(0.0, (next_ns - port.now_ns) / 1e6))
            times.append(port.now_ns / 1e9)
            imu.read()
            for name, chain in every.items():
                angles[name].append(chain.update(imu.counts))
    times = np.array(times)
    counted = times > times[0] + SETTLE_S
    truth = np.transpose(roll_pitch_deg(up_from_quaternion([motion.truth(t) for t in times])))
    return {
        name: float(np.sqrt(np.mean(np.sum((np.array(a) - truth)[counted] ** 2, axis=1))))
        for name, a in angles.items()
    }


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    parser.add_argument("--seconds", type=float, default=6.0, help="virtual, per speed")
    options = parser.parse_args(arguments)
    table = {}
    for rpm in RPM:
        print(f"{rpm} RPM ...", end="\r", flush=True)
        table[rpm] = shaken(rpm, options.seconds)
    print(f"{'RMS error, degrees; RPM':30}" + "".join(f"{rpm:>8}" for rpm in RPM))
    for name in table[RPM[0]]:
        print(f"{name:30}" + "".join(f"{table[rpm][name]:8.2f}" for rpm in RPM))
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
