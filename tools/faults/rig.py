# SPDX-License-Identifier: MIT
"""One app on a virtual board, in motion, watched at every tick while faults come and go."""

import random
import sys
import tempfile
from dataclasses import dataclass

import numpy as np

from tools.faults import actions
from tools.faults.kinds import bus_faults
from tools.recordings import up_from_quaternion, up_from_roll_pitch
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.chip.minimu9 import L3GD20Chip, LSM303Chip
from tools.virtual.motion import FreeMotion, Sequence, Sinusoid, Still
from tools.virtual.port import Port

REST_S = 0.8  # before the motion; the app measures the gyro's bias in it
SETTLE_S = 2.5  # from the start of the motion to the first fault
BIAS_DPS = (2.0, -1.5, 1.0)
AGE_US, OUTPUTS = 3, 19  # places of firmware.tick.words
SWING_DEG, SWING_HZ = 40.0, 0.398  # 100 deg/s at its fastest


@dataclass
class Outcome:
    """What one injection did. Seconds and degrees; recovery_s None: it did not recover."""

    detected: bool
    recovery_s: float | None
    error_deg: float  # largest while the app claimed its angle
    during_deg: float  # largest while the fault lasted, claimed or not
    after_deg: float  # one second after its end
    yaw_deg: float  # drift of the yaw since the fault began, while it was claimed
    yaw_after_deg: float  # the same one second after its end
    before_deg: float  # largest in the half second before
    counts: dict


def motion(name, seed):
    """The sensor's motion after REST_S of rest: "free" or "swing"."""
    if name == "swing":
        return Sequence((Still(), REST_S), (Swing(), 0.0))
    return FreeMotion(seed, rest_s=REST_S)


class Swing(Sinusoid):
    """Roll to and fro, 100 deg/s at its fastest, begun without a jump of the rate."""

    def __init__(self):
        super().__init__(SWING_DEG, SWING_HZ, "roll", offset_deg=SWING_DEG, phase_deg=-90.0)


BOARDS = {  # name: platform, MicroPython's version
    "rp2": ("rp2", (1, 25, 0)),
    "rp2 hard": ("rp2", (1, 26, 1)),
    "esp32": ("esp32", (1, 25, 0)),
}


def board_of(name):
    """(platform, chip or None, version) of one of BOARDS, or of a chip and a version, as
    "ESP32S3 1.29"."""
    if name in BOARDS:
        return BOARDS[name][0], None, BOARDS[name][1]
    chip, version = name.split()
    major, minor = version.split(".")
    platform = "esp32" if chip.startswith("ESP32") else "rp2"
    return platform, chip, (int(major), int(minor), 0)


class Rig:
    """`with Rig(kind, board, seed) as rig: rig.inject(n)`; `rows` holds every tick so far.

    board: see board_of(). A row: time s, new good burst, claimed (neither stale nor uncertain),
    age ms; roll, pitch and yaw in millidegrees.
    """

    SPREAD_S = (0.0, 0.004)  # a fault begins so long after a tick
    period_s = 0.004

    def __init__(self, kind, board, seed=0):
        self.kind = kind
        self.platform, self.machine, self.version = board_of(board)
        self.random = random.Random(f"{kind.name} {board} {seed}")
        self.rows = []
        self.chips = self._make_chips(motion(kind.motion, seed), seed + 1)
        self.chip = self.chips[0]
        self.bus = Bus(*self.chips)

    def _make_chips(self, moves, seed):
        return [MPU6050Chip(moves, gyro_bias_dps=BIAS_DPS, seed=seed)]

    def _choose_sensor(self):
        """Before the app starts."""

    def __enter__(self):
        self._folder = tempfile.TemporaryDirectory()
        self.port = Port(
            self.platform, {0: self.bus}, machine_name=self.machine, version=self.version,
            root=self._folder.__enter__(),
        )  # fmt: skip
        self.port.__enter__()
        try:
            self._begin()
        except BaseException:
            self.__exit__(*sys.exc_info())
            raise
        return self

    def __exit__(self, *error):
        self.port.__exit__(*error)
        self._folder.__exit__(*error)

    def _begin(self):
        from firmware.app import App

        self.app = App()
        for name, value in self.kind.knobs.items():
            self.app.config.set(name, value)
        self.port.connect_int(self.chip, self.app.board.int_pin)
        self._choose_sensor()
        self.start()
        self.run(REST_S + SETTLE_S - self.now_s)

    def start(self):
        """Start the app and look at each of its ticks."""
        self.app.start()
        if self.app.tick.drive.__name__ != "watched":
            self.watch()

    def watch(self):
        """Look at each tick of the app, from now on."""
        app, outputs = self.app, self.app.outputs
        hand_over = outputs.hand_over

        def again():
            hand_over()
            self._wrap(app.tick)

        outputs.hand_over = again
        self._wrap(app.tick)

    def _wrap(self, tick):
        drive, rows, app = tick.drive, self.rows, self.app

        def watched(fresh):
            drive(fresh)
            roll, pitch, yaw = app.angles_mdeg
            claimed = not (app.stale or app.uncertain)
            rows.append((
                self.port.now_ns * 1e-9, bool(fresh), claimed, tick.words[AGE_US] / 1000,
                roll, pitch, yaw,
            ))  # fmt: skip

        tick.drive = watched
        tick.words[OUTPUTS] = 1

    def stats(self):
        """What the app counted."""
        return dict(self.app.stats())

    @property
    def uncaught(self):
        """Exceptions that left a callback, or were caught by the loop only."""
        return len(self.port.errors) + self.app.stats()["errors"]

    @property
    def now_s(self):
        """Virtual time."""
        return self.port.now_ns * 1e-9

    def run(self, seconds):
        """Let virtual time pass."""
        self.port.run_ms(max(0.0, seconds) * 1000)

    def inject(self, number):
        """One fault of the kind at a random moment; its Outcome."""
        kind = self.kind
        self.run(self.random.uniform(0.1, 0.5))
        for_s = self.random.uniform(*kind.for_s)
        before = self.stats()
        first = len(self.rows)
        if isinstance(kind.faults[0], str):
            began = self.now_s
            before = getattr(actions, kind.faults[0])(self, for_s) or before
            ended = self.now_s
            if kind.faults[0] == "wrap":
                began = ended  # the app was started anew before it, and its yaw with it
        else:
            began = self.now_s + self.random.uniform(*self.SPREAD_S)
            addresses = [chip.address for chip in self.chips]
            self.bus.faults[:] = bus_faults(kind, began, for_s, number, addresses)
            self.run(began + for_s - self.now_s)
            ended = began + for_s
            if all(fault.done for fault in self.bus.faults) and kind.name == "sda_held":
                ended = began  # it lasts until the clocks come
        self.run(ended + kind.after_s - self.now_s)
        self.bus.faults.clear()
        return self._judge(began, ended, first, before)

    def _judge(self, began, ended, first, before):
        rows = self.rows[max(0, first - 125) :]
        time_s = np.array([row[0] for row in rows])
        error = self.errors(rows)
        yaw = self.yaw_errors(rows, int(np.sum(time_s < began)) - 1)
        claimed = np.array([row[2] for row in rows])
        inside = time_s >= began
        during = inside & (time_s <= ended + 0.002)
        late = np.abs(time_s - (ended + 1.0)) < 0.01
        after = self.stats()
        sees = self.kind.sees
        if "timeout" in sees and self.app.board.one_error:
            sees = (*sees, "nack")
        moved = {
            key: after[key] - before.get(key, 0)
            for key in after
            if isinstance(after[key], int) and after[key] != before.get(key, 0)
        }
        return Outcome(
            detected=any(moved.get(key, 0) > 0 for key in sees),
            recovery_s=self._recovery(rows, ended),
            error_deg=_largest(error[inside & claimed]),
            during_deg=_largest(error[during]),
            after_deg=_largest(error[late]),
            yaw_deg=_largest(yaw[inside & claimed]),
            yaw_after_deg=_largest(yaw[late & claimed]),
            before_deg=_largest(error[~inside]),
            counts=moved,
        )

    def _recovery(self, rows, ended):
        """Seconds from the end of the fault to the first of an unbroken row of good ticks."""
        last_s = None
        previous = None
        for t_s, fresh, *_ in rows:
            late = previous is not None and t_s - previous > 1.6 * self.period_s
            if fresh:
                if last_s is None or (late and not self.kind.fifo):
                    last_s = t_s
            else:
                last_s = None
            previous = t_s
        if last_s is None or self.now_s - previous > 0.05:
            return None
        return max(0.0, last_s - ended)

    def errors(self, rows):
        """Angle between the true and the estimated up, degrees, of each row."""
        truth = up_from_quaternion(np.array([self.chip.truth(row[0]) for row in rows]))
        told = up_from_roll_pitch(
            np.array([row[4] for row in rows]) / 1000, np.array([row[5] for row in rows]) / 1000
        )
        cross = np.linalg.norm(np.cross(told, truth), axis=1)
        return np.degrees(np.arctan2(cross, np.sum(told * truth, axis=1)))

    def yaw_errors(self, rows, first):
        """Size of the yaw's error less that of row `first`, degrees, of each row."""
        q = np.array([self.chip.truth(row[0]) for row in rows]).T
        w, x, y, z = q
        true = np.degrees(np.arctan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z))
        off = np.array([row[6] for row in rows]) / 1000 - true
        return np.abs((off - off[max(0, first)] + 180) % 360 - 180)


class MinimuRig(Rig):
    """The same with a MinIMU-9 for a sensor: two chips, and what happens, happens to both."""

    def _make_chips(self, moves, seed):
        gyro = L3GD20Chip(moves, seed=seed, gyro_bias_dps=BIAS_DPS)
        return [gyro, LSM303Chip(moves, seed=seed)]

    def _choose_sensor(self):
        from minimu9 import MinIMU9

        self.app.imu = imu = MinIMU9(self.app.board.i2c())
        if self.app.config.drive == "data-ready":
            # a sample that comes while DRDY is still high makes no edge: the guard ticks next
            self.period_s = 2 / imu.rate_hz


def _largest(values):
    return float(values.max()) if len(values) else 0.0
