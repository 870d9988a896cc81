# SPDX-License-Identifier: MIT
"""Runs on a board that holds the project: what it is and how well it does, a line each.

Printed: "NAME: value"; a line that begins with "!" is something to look at. tools/board_check.py
starts it, and its output is the report.
"""

import gc
import os
import sys
import time

_NAMES = ("ax", "ay", "az", "gx", "gy", "gz")
_NOISY_DPS, _NOISY_G = 0.25, 0.02  # more than any part's own, behind 44 Hz
_SECONDS = globals().get("seconds", 2.0)  # that each measurement takes


def tell(name, value):
    print("%s: %s" % (name, value))


def attention(text):
    print("! " + text)


def attempt(name, work):
    """What work() returns; a failure is part of the report."""
    try:
        return work()
    except Exception as error:
        attention("%s: %s: %s" % (name, type(error).__name__, error))
        return None


def machine_part():
    import machine

    i = sys.implementation
    tell("board", i._machine)
    tell("micropython", sys.version)
    tell("mpy", hex(getattr(i, "_mpy", 0)))
    tell("processor", "%d MHz" % (machine.freq() // 1000000))
    gc.collect()
    tell("heap", "%d bytes free of %d" % (gc.mem_free(), gc.mem_free() + gc.mem_alloc()))
    stat = os.statvfs("/")
    tell("flash", "%d kB free" % (stat[0] * stat[3] // 1024))
    tell("reset cause", machine.reset_cause())


def wires_part(board, config):
    tell("row", "%s, SDA GP%d, SCL GP%d, INT GP%s, outputs %s, I2C%d at %d Hz%s" % (
        board.name, board.sda, board.scl, board.int_pin, board.outputs, board.i2c_id,
        board.bus_hz, ", bit-banged" if board.soft else "",
    ))  # fmt: skip
    for text in board.warnings():
        attention(text)
    tell("lines", "SDA, SCL %s against a weak pull-down, %s against a pull-up" % (
        board.line_levels(False), board.line_levels(True)))  # fmt: skip
    found = board.scan()
    tell("found on the bus", ", ".join(["0x%02X" % address for address in found]) or "nothing")
    if config.address not in found:
        from firmware.diagnose import diagnose

        attention(diagnose(board, config.address))


def sensor_part(app):
    imu = app.imu
    tell("sensor", "WHO_AM_I 0x%02X, %s at 0x%02X, bursts %s" % (
        imu.who_am_i, imu.profile.name, imu.address,
        "in the background" if imu.split else "blocking"))  # fmt: skip
    failed = 0
    began = time.ticks_us()
    for _ in range(int(250 * _SECONDS)):
        try:
            imu.read()
            failed += not imu.plausible()
        except OSError:
            failed += 1
    took_us = time.ticks_diff(time.ticks_us(), began) / int(250 * _SECONDS)
    tell("burst", "%.0f us, %d of %d failed" % (took_us, failed, int(250 * _SECONDS)))
    if failed:
        attention("transfers fail: shorter wires, pull-ups of 4.7 kOhm, a smaller bus_hz")


def noise_part(imu):
    """Mean and deviation of each axis, in deg/s and g."""
    sums, squares, first, n = [0] * 6, [0] * 6, None, 0
    began = time.ticks_ms()
    while time.ticks_diff(time.ticks_ms(), began) < 500 * _SECONDS:
        imu.read()
        values = list(imu.counts[:3]) + list(imu.counts[4:])
        first = first or values
        for i in range(6):
            off = values[i] - first[i]
            sums[i] += off
            squares[i] += off * off
        n += 1
    for i in range(6):
        lsb, unit = (imu.accel_lsb_per_g, "g") if i < 3 else (imu.gyro_lsb_per_dps, "deg/s")
        deviation = max(0, n * squares[i] - sums[i] * sums[i]) ** 0.5 / n / lsb
        mean = (first[i] + sums[i] / n) / lsb
        tell("noise " + _NAMES[i], "%.4f %s about %.3f" % (deviation, unit, mean))
        if deviation > (_NOISY_G if i < 3 else _NOISY_DPS):
            attention("%s is noisy, or it was not at rest" % _NAMES[i])
    tell("temperature", "%.1f degC" % imu.temp_c())


def self_test_part(app):
    good, lines = app.self_test()
    tell("self-test", ("passed: " if good else "NOT passed: ") + ", ".join(lines))
    if not good:
        attention("the self-test did not pass: was it at rest? clones have no trim")


def busy(ms):
    """What ordinary programs do: lists and texts, and collections in between."""
    end = time.ticks_add(time.ticks_ms(), ms)
    while time.ticks_diff(end, time.ticks_ms()) > 0:
        "".join([str(n) for n in range(60)])


def timing_part(app, name, work):
    app.loop.stop()
    app.loop.start()
    work(int(1000 * _SECONDS))
    stats = app.stats()
    tell("loop " + name, "%d ticks (%s), %d lost, jitter p99 %d us, largest %d us, step p50 %d, "
         "p99 %d, largest %d us, errors %d" % (
             stats["ticks"], stats["tick"], stats["lost"], stats["jitter_p99_us"],
             stats["jitter_max_us"], stats["step_p50_us"], stats["step_p99_us"],
             stats["step_max_us"], stats["errors"]))  # fmt: skip
    if stats["errors"]:
        attention("errors in the tick")
    if stats["lost"] and (name == "idle" or stats["tick"] == "hard"):
        attention("ticks were lost: %s" % name)


def faults_part(app):
    from firmware.stats import faults

    seen = faults(app)
    tell("faults", seen or "none")
    tell("angles", "%.1f %.1f %.1f deg, stale %s, uncertain %s" % (
        app.roll_deg, app.pitch_deg, app.yaw_deg, app.stale, app.uncertain))  # fmt: skip
    if app.stale:
        attention("stale")


def main():
    attempt("machine", machine_part)
    from firmware.app import App

    app = App()
    for text in app.warnings:
        attention(text)
    tell("knobs", app.changed() or "all have their defaults")
    if attempt("board", lambda: (app.board.check_version(), app.board.use(app.config))) is None:
        return
    attempt("wires", lambda: wires_part(app.board, app.config))
    began = time.ticks_ms()
    app.start()
    tell("start", "%d ms" % time.ticks_diff(time.ticks_ms(), began))
    tell("gyro bias", "%.2f %.2f %.2f deg/s" % tuple(app.calibration.gyro_bias_dps))
    for text in app.warnings:
        attention(text)
    app.stop()
    attempt("sensor", lambda: sensor_part(app))
    attempt("noise", lambda: noise_part(app.imu))
    app.start()
    attempt("self-test", lambda: self_test_part(app))
    attempt("timing", lambda: timing_part(app, "idle", time.sleep_ms))
    attempt("timing", lambda: timing_part(app, "busy", busy))
    attempt("faults", lambda: faults_part(app))
    gc.collect()
    tell("heap with the app", "%d bytes free" % gc.mem_free())
    app.stop()


attempt("check", main)
print("end of the check")
