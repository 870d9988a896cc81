# SPDX-License-Identifier: MIT
"""The virtual hardware: one chip model, plugged into CPython and into an emulated RP2040.

A robot's own code is tested with it, without a board and faster than real time:

    from tools.virtual import Bus, MPU6050Chip, Port, faults, motion

    def test_the_robot_knows_its_tilt_and_survives_a_loose_wire(tmp_path):
        chip = MPU6050Chip(motion.Still(roll_deg=10.0), gyro_bias_dps=(2.0, 0.0, 0.0))
        bus = Bus(chip, faults=[faults.make("nack", at_s=2.5, for_s=0.05)])
        with Port("rp2", {0: bus}, root=tmp_path) as port:
            port.connect_int(chip, 6)  # GP6
            from firmware.app import App

            app = App()
            app.start()
            port.run_ms(3000)
            assert app.stats()["nack"] > 0
            assert abs(app.roll_deg - 10.0) < 0.5 and not app.stale
        assert port.errors == []  # nothing left a callback

Board code is imported inside the `with`; Port(paths=[FOLDER]) finds modules of your own, as
flash would hold them. `VirtualPico(bus=bus, root=True)` in Port's place runs the same files on the
real MicroPython firmware. `install_micropython()` is enough for code that needs no board.

Each name is loaded when it is first asked for: a test on CPython needs no emulator.
"""

from importlib import import_module

_PLACES = {
    "Bus": "bus",
    "MPU6050Chip": "chip",
    "Port": "port",
    "VirtualPico": "pico",
    "install_micropython": "port",
}
_MODULES = {
    "faults": "faults",
    "firmware": "images",
    "motion": "motion",
    "profiles": "chip.profiles",
    "quaternions": "motion.quaternions",
    "registers": "chip.registers",
    "tolerances": "chip.tolerances",
}
__all__ = [*_PLACES, *_MODULES]


def __getattr__(name):
    """Load what is asked for, and keep it here."""
    if name in _MODULES:
        found = import_module(f"{__name__}.{_MODULES[name]}")
    elif name in _PLACES:
        found = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__():
    return sorted({*globals(), *__all__})
