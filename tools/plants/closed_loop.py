# SPDX-License-Identifier: MIT
"""A plant, the virtual sensor on it, and the board's own program that steers it."""

import importlib
import tempfile

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.port import Port


def run(name, make_plant, seconds, platform="rp2", drive=None, chips=None, **chip):
    """firmware.apps.NAME in closed loop for `seconds`; returns (plant, app, stats).

    make_plant(port, output pins) -> the plant. `drive(app, t_s)` is called every 10 ms, as the
    pilot. chip: imperfections of the sensor, as for MPU6050Chip; or `chips`, those of a MinIMU-9.
    """
    devices = chips or (MPU6050Chip(**chip),)
    with tempfile.TemporaryDirectory() as root, Port(
        platform, {0: Bus(*devices, log_length=1)}, root=root
    ) as port:
        from firmware.app import App

        app = App()
        plant = make_plant(port, app.board.outputs)
        for device in devices:
            device.set_motion(plant)
        if chips:
            from minimu9 import MinIMU9

            app.imu = MinIMU9(app.board.i2c())
        importlib.import_module(f"firmware.apps.{name}").start(app)
        if name == "balance":
            app.balance.arm()
        began = port.now_ns
        while port.now_ns - began < seconds * 1e9:
            port.run_ms(10)
            if drive is not None:
                drive(app, port.now_ns / 1e9)
        stats = app.stats()
        app.stop()
        if app.outputs.error:
            raise RuntimeError(f"an output raised: {app.outputs.error!r}")
        return plant, app, stats
