# SPDX-License-Identifier: MIT
"""What the driver's tests share: a virtual board with chips on its bus, and a constant motion."""

from contextlib import contextmanager

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.port import Port

# The three ways in which a driver meets a bus: RP2's block (bursts in the background), bit-banged
# pins, and the ESP32
BUSES = ("rp2", "rp2 soft", "esp32")

COUNTS = ("ax", "ay", "az", "temp", "gx", "gy", "gz")


class Feel:
    """A motion source that always feels the same: g, deg/s, degC."""

    duration_s = None

    def __init__(self, accel=(0.0, 0.0, 1.0), gyro=(0.0, 0.0, 0.0), temp=25.0):
        self.sample = (*accel, *gyro, temp)

    def at(self, t_s):
        return self.sample

    def truth(self, t_s):
        return (1.0, 0.0, 0.0, 0.0)


class Rig:
    """A running Port: `.bus`, `.chip` (the first), `.i2c`, and the driver imported on it."""

    def __init__(self, port, bus, i2c):
        import mpu6050

        self.port, self.bus, self.i2c = port, bus, i2c
        self.chip = bus.devices[0] if bus.devices else None
        self.mpu6050 = mpu6050

    def sensor(self, **settings):
        return self.mpu6050.MPU6050(self.i2c, **settings)

    def wait_ms(self, ms):
        self.port.run_ms(ms)

    def fault(self, name, **settings):
        """Put a fault on the bus from now on, without end unless `for_s` says so."""
        self.bus.faults.append(make(name, at_s=self.port.now_ns * 1e-9, **settings))

    def mend(self):
        """End all faults."""
        self.bus.faults.clear()
        self.bus.advance(self.port.now_ns)

    def transactions(self):
        """The log since the last call."""
        log = list(self.bus.log)
        self.bus.log.clear()
        return log


@contextmanager
def rig(kind="rp2 soft", *chips, motion=None, machine_name=None, bus_id=0, **settings):
    """A board of one of BUSES with these chips, or one noise-free chip of these settings."""
    settings.setdefault("noise", False)
    bus = Bus(*(chips or (MPU6050Chip(motion or Feel(), **settings),)))
    sda = 4 + 2 * bus_id
    where = {"buses": {bus_id: bus}, "wiring": {bus_id: (sda, sda + 1)}}
    with Port(kind.split()[0], machine_name=machine_name, **where) as port:
        import machine

        pins = {"scl": machine.Pin(sda + 1), "sda": machine.Pin(sda)}
        if kind.endswith("soft"):
            i2c = machine.SoftI2C(freq=400_000, **pins)
        else:
            i2c = machine.I2C(bus_id, freq=400_000, **pins)
        yield Rig(port, bus, i2c)
