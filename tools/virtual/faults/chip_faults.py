# SPDX-License-Identifier: MIT
"""What goes wrong in a chip, its supply, its INT line and its clock."""

from tools.virtual.faults.fault import Fault


class BrownOut(Fault):
    """The supply dips: the chip comes back asleep, with zeros and default ranges."""

    def __init__(self, for_s=0.001, **times):
        super().__init__(for_s=for_s, **times)

    def begin(self, bus):
        self.hits += 1
        self.device(bus).power_off()

    def end(self, bus):
        self.device(bus).power_on()


class Unplugged(Fault):
    """The cable is out; plugged in again, there may be another part (`profile`) on it."""

    def __init__(self, profile=None, **times):
        super().__init__(**times)
        self._profile = profile

    def begin(self, bus):
        self.hits += 1
        self.device(bus).power_off()

    def end(self, bus):
        self.device(bus).power_on(self._profile)


class StuckData(Fault):
    """The output registers no longer change: the same burst again and again."""

    def begin(self, bus):
        self.hits += 1
        self.device(bus).set_frozen(True)

    def end(self, bus):
        self.device(bus).set_frozen(False)


class IntDead(Fault):
    """The INT line is broken."""

    def begin(self, bus):
        self.hits += 1
        self.device(bus).set_int_dead(True)

    def end(self, bus):
        self.device(bus).set_int_dead(False)


class ClockOff(Fault):
    """The chip's clock is fast by the fraction `error`."""

    def __init__(self, error=0.02, **times):
        super().__init__(**times)
        self._error, self._before = error, 0.0

    def begin(self, bus):
        self.hits += 1
        self._before = self.device(bus).clock_error
        self.device(bus).set_clock_error(self._error)

    def end(self, bus):
        self.device(bus).set_clock_error(self._before)


class FifoOverflow(Fault):
    """The FIFO gets more than it holds, so that its oldest bytes and the alignment are lost."""

    def __init__(self, extra=5, for_s=0.0, **times):
        super().__init__(for_s=for_s, **times)
        self._extra = extra

    def begin(self, bus):
        self.hits += 1
        self.device(bus).overfill_fifo(self._extra)


class FifoMisaligned(Fault):
    """`lost` bytes vanish from the FIFO's head without an overflow."""

    def __init__(self, lost=1, for_s=0.0, **times):
        super().__init__(for_s=for_s, **times)
        self._lost = lost

    def begin(self, bus):
        self.hits += self.device(bus).drop_fifo(self._lost)


class Saturation(Fault):
    """The sensors feel more than they can measure (g, dps added to the motion)."""

    def __init__(self, accel_g=(20.0, 0.0, 0.0), gyro_dps=(3000.0, 0.0, 0.0), **times):
        super().__init__(**times)
        self._accel_g, self._gyro_dps = accel_g, gyro_dps

    def begin(self, bus):
        self.hits += 1
        self.device(bus).set_overload(self._accel_g, self._gyro_dps)

    def end(self, bus):
        self.device(bus).set_overload()
