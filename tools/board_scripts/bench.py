# SPDX-License-Identifier: MIT
# Runs on the board: times each stage and prints one line for each figure. tools/bench.py calls
# main(), and main_app() after a new start, since a program loads only what it uses.
# Times are net of an empty call, each call timed by itself, the collector off; the first one,
# which comes after a pause, is not counted.

import gc
import sys
import time
from array import array

import micropython
from micropython import const

_DUE = const(12)  # ticks until the foreground is wanted, a place of firmware.tick.words
_PAST_START = const(720)  # samples after which a start is over: 2.9 s at 250 Hz

_CYCLE = const(120)  # samples at 250 Hz in which all comes once that comes by turns: six blocks

_laps = array("i", [0] * _CYCLE)
_empty_us = 0.0


class Nothing:
    def update(self, _):
        pass


def imported(name, load):
    gc.collect()
    used = gc.mem_alloc()
    start = time.ticks_us()
    value = load()
    spent = time.ticks_diff(time.ticks_us(), start)
    gc.collect()
    print("module", name, spent, gc.mem_alloc() - used)
    return value


def laps(call, argument, before, n, second=None):
    """Time n calls of call(argument), or call(argument, second), after before() each; mean heap
    bytes of one."""
    # locals: to look a name up between the two readings takes some microseconds more by chance
    ticks_us, ticks_diff, times = time.ticks_us, time.ticks_diff, _laps
    used = gc.mem_alloc()
    for i in range(n):
        before()
        if second is None:
            start = ticks_us()
            call(argument)
        else:
            start = ticks_us()
            call(argument, second)
        times[i] = ticks_diff(ticks_us(), start)
    return (gc.mem_alloc() - used) / n


def locked(call, argument, before, second):
    """Whether five calls do without the heap."""
    micropython.heap_lock()
    try:
        for _ in range(5):
            before()
            if second is None:
                call(argument)
            else:
                call(argument, second)
        return 1
    except MemoryError:
        return 0
    finally:
        micropython.heap_unlock()


def row(name, call, argument=None, before=gc.isenabled, n=_CYCLE, second=None):
    gc.collect()
    gc.disable()
    laps(call, argument, before, 1, second)  # the first after a pause has a gap to look at
    size = laps(call, argument, before, n, second)
    gc.enable()
    gc.collect()
    spent = _laps[:n]
    mean = sum(spent) / n - _empty_us
    print("row", name, mean, max(spent) - _empty_us, size, locked(call, argument, before, second))


def settle_bus():
    time.sleep_us(700)


def next_sample():
    time.sleep_ms(2)  # the sensor has a new one each millisecond


# Bound methods are made once, as a loop does: looking one up takes 3 to 8 us. They are default
# arguments, since a closure over more than four names allocates at each call.
def one_step(imu, filt):
    def step(_, read=imu.read, counts=imu.counts, update=filt.step, angles=filt.angles_mdeg):
        read()
        update(counts)
        angles[0]
        angles[1]

    return step


def one_split(imu, filt):
    def step(
        _,
        start=imu.start,
        collect=imu.collect,
        counts=imu.counts,
        update=filt.step,
        angles=filt.angles_mdeg,
    ):
        if not collect():
            raise OSError("the burst has not arrived")
        start()
        update(counts)
        angles[0]
        angles[1]

    return step


def load_driver():
    from mpu6050 import MPU6050

    return MPU6050


def load_fixed_kalman():
    from attitude.fixed import KalmanTilt2

    return KalmanTilt2


def load_fixed_attitude():
    from attitude.fixed import Attitude

    return Attitude


def load_float_kalman():
    from attitude import KalmanTilt

    return KalmanTilt


def load_float_attitude():
    from attitude import Attitude

    return Attitude


class Skewed:
    """A calibration that uses all it can: biases, scale and cross-axis, mounted at an angle."""

    gyro_bias_dps = (1.5, -2.5, 0.7)
    accel_bias_g = (0.03, -0.02, 0.05)
    gyro_matrix = (0.98, 0.1, 0.02, -0.1, 1.01, 0.03, 0.01, -0.02, 0.99)
    accel_matrix = (0.99, 0.1, 0.01, -0.1, 1.02, 0.02, 0.01, -0.02, 0.98)


def measure_empty():
    """What a call of nothing takes."""
    global _empty_us
    gc.collect()
    gc.disable()
    laps(Nothing().update, None, gc.isenabled, len(_laps))
    gc.enable()
    _empty_us = sum(_laps) / len(_laps)


def main():
    import machine

    from firmware import board

    print("board", sys.implementation._machine.replace(" ", "_"), machine.freq() // 1000000)
    driver = imported("mpu6050", load_driver)
    kalman2 = imported("attitude.fixed.KalmanTilt2", load_fixed_kalman)
    attitude = imported("attitude.fixed.Attitude", load_fixed_attitude)
    kalman = imported("attitude.KalmanTilt", load_float_kalman)
    float_attitude = imported("attitude.Attitude", load_float_attitude)

    measure_empty()
    print("empty", _empty_us)

    sensor_bus = board.find().i2c()
    imu = driver(sensor_bus)
    row("bus.read14", lambda _, read=imu.read: read())
    kalman2 = kalman2()
    kalman2.calibrate(Skewed)
    attitude = attitude()
    attitude.calibrate(Skewed)
    counts = array("h", (-300, 210, 4090, -3000, 250, -130, 75))
    for _ in range(_PAST_START):
        attitude.step(counts)
    row("fixed.kalman2.step", kalman2.step, counts)
    row("fixed.kalman2.update", kalman2.update, counts)
    row("fixed.attitude.step", attitude.step, counts)
    row("fixed.attitude.update", attitude.update, counts)
    kalman = kalman()
    row("float.kalman.update", lambda _: kalman.update(4.2, 3.5, 0.004))
    float_attitude = float_attitude(250)
    sample = (3.5, -2.0, 1.0, -0.1, 0.05, 1.0, 0.004)
    row("float.attitude.update", lambda _: float_attitude.update(*sample), n=10)
    row("step.kalman2", one_step(imu, kalman2))
    row("step.attitude", one_step(imu, attitude))
    imu.start()
    settle_bus()
    row("split.kalman2", one_split(imu, kalman2), None, settle_bus)
    row("split.attitude", one_split(imu, attitude), None, settle_bus)


def started(app, **knobs):
    app.config.set("rest_s", 0.1)
    for name in knobs:
        app.config.set(name, knobs[name])
    app.start()


@micropython.native
def trusting(_counts, _memory):
    """A judge that finds every burst good."""
    return 0


def without(_):
    """A foreground that does nothing."""


def app_steps(app):
    """A tick's work in the app, with and without a judge of its bursts."""
    from firmware.tick import judge

    for burst in ("blocking", "split"):
        started(app, burst=burst)
        app.loop.stop()
        tick, before = app.tick, next_sample
        for _ in range(_PAST_START):
            app.filter.step(app.imu.counts)
        tick.after = without
        tick.words[_DUE] = 1 << 20
        tick.timing.start(2000, True, time.ticks_us())  # stopped, begin() would do nothing
        if burst == "split":

            def before(begin=tick.begin):
                begin(None)
                next_sample()

        row("app." + burst, tick.step, 2000, before, second=1000)
        if burst == "split":
            tick.timing.follow(time.ticks_us())  # after a long gap it would level anew
            row("app.run", tick.run, None, before)
        checked, judge.judge = judge.judge, trusting
        tick.wire(app.imu, app.bus, app.period_us, False, 450 if burst == "split" else 0)
        row("app." + burst + ".unchecked", tick.step, 2000, before, second=1000)
        judge.judge = checked
        tick.after = app.foreground.after
        app.loop.stop()


def three(_, angles):
    angles[0]
    angles[1]
    angles[2]


def turns(ms):
    """How often a program can go round in so many milliseconds."""
    n = 0
    end = time.ticks_add(time.ticks_us(), 1000 * ms)
    while time.ticks_diff(end, time.ticks_us()) > 0:
        n += 1
    return n


def processor_left(app):
    """The part of the processor's time that the app leaves to the program beside it."""
    app.stop()
    alone = turns(40)
    for rate_hz in (250, 500, 1000):
        started(app, rate_hz=rate_hz)
        time.sleep_ms(20)
        print("left", rate_hz, turns(40) / alone)
        app.stop()


def main_app():
    from firmware.app import App

    measure_empty()
    app = App()
    app_steps(app)
    row("read.angles", three, None, second=app.angles_mdeg)
    processor_left(app)
