# SPDX-License-Identifier: MIT
"""The chip below its bus: supply, clock, sensors, FIFO and INT as the registers set them."""

import numpy as np

from tools.virtual.chip import registers as reg
from tools.virtual.chip.back_door import BackDoor
from tools.virtual.chip.fifo import Fifo
from tools.virtual.chip.interrupts import IntPin
from tools.virtual.chip.motion_engine import MotionEngine
from tools.virtual.chip.profiles import ADDRESS, find
from tools.virtual.chip.sampler import Sampler
from tools.virtual.chip.sensing import Triad
from tools.virtual.chip.settings import Settings, packet
from tools.virtual.chip.trim import FactoryTrim
from tools.virtual.motion import Still

_NEVER = 1 << 62
_SLEEP, _CYCLE, _CLK_STOPPED = 0x40, 0x20, 7
_FIFO_ON = 0x40
_FIFO_STOPS = 0x40


class Part(BackDoor):
    """State below the registers. The arguments are those of tools.virtual.chip.MPU6050Chip."""

    def __init__(
        self,
        motion=None,
        address=ADDRESS,
        profile="MPU6050",
        seed=0,
        noise=True,
        clock_error=0.0,
        gyro_bias_dps=(0, 0, 0),
        accel_bias_g=(0, 0, 0),
        gyro_bias_dps_per_c=(0, 0, 0),
        accel_bias_g_per_c=(0, 0, 0),
        gyro_matrix=None,
        accel_matrix=None,
        trim_codes=None,
        self_test_error=0.0,
    ):
        self.address = address
        self.profile = find(profile)
        self.registers = bytearray(128)
        self.now_ns = 0
        self.on_int = None
        self._frozen = False
        self._trim_arguments = (seed, trim_codes, self_test_error)
        self._pin = IntPin(self.registers)
        self._pin.on_change = self._int_changed
        random = np.random.default_rng(seed)
        self._accel = Triad(accel_bias_g, accel_bias_g_per_c, accel_matrix, random)
        self._gyro = Triad(gyro_bias_dps, gyro_bias_dps_per_c, gyro_matrix, random)
        self._sampler = Sampler(self._accel, self._gyro, motion or Still(), clock_error)
        self._noise = noise
        self._engine = MotionEngine(self.registers)
        self._overload = ((0.0,) * 3, (0.0,) * 3)
        self._powered = True
        self._silent_until = 0
        self._wake_ns = _NEVER
        self._eager = False  # somebody inside the chip has to see every sample at its time
        self._announced = 0
        self._fresh = False  # there is a sample that the output registers do not show yet
        self._set_profile()
        self._clear_registers()

    # time

    @property
    def int_level(self):
        """0 or 1 on the INT pin."""
        return self._pin.level

    def advance(self, now_ns):
        """Let time pass; samples are computed when somebody looks."""
        if now_ns >= self._wake_ns:
            self._events(now_ns)
        if now_ns > self.now_ns:
            self.now_ns = now_ns

    def next_event_ns(self):
        """When the chip next does something by itself (INT edge, FIFO overflow), ns, or None."""
        return None if self._wake_ns == _NEVER else self._wake_ns

    def _events(self, now_ns):
        if self._eager:
            self._sync(now_ns)
        elif self._sampler.running:
            tick = self._sampler.output_at(now_ns)
            if tick > self._announced:
                self._announced = tick
                self._trigger(reg.DATA_RDY, self._sampler.time_ns(tick))
        end = self._pin.next_ns
        if end is not None and end <= now_ns:
            self.now_ns = max(self.now_ns, end)
            self._pin.advance(end)
        self._plan(now_ns)

    def _trigger(self, bit, t_ns):
        self.now_ns = max(self.now_ns, t_ns)
        self._pin.trigger(bit, t_ns)

    def _plan(self, now_ns):
        """Note when `advance` has to do something next."""
        wake = _NEVER if self._pin.next_ns is None else self._pin.next_ns
        sampler = self._sampler
        if sampler.running and (self._eager or self.registers[reg.INT_ENABLE] & reg.DATA_RDY):
            step = 1 if self._eager else sampler.every
            tick = sampler.tick(now_ns)
            wake = min(wake, sampler.time_ns(tick - tick % step + step))
        self._wake_ns = wake

    def _int_changed(self, level):
        if self.on_int is not None:
            self.on_int(level)

    # what the registers mean

    def _set_profile(self):
        profile = self.profile
        self.fifo = Fifo(profile.fifo_bytes)
        self.trim = FactoryTrim(profile, *self._trim_arguments)
        self._accel.density = profile.accel_noise if self._noise else 0.0
        self._gyro.density = profile.gyro_noise if self._noise else 0.0

    def _clear_registers(self):
        """Reset values; the sensors forget."""
        registers = self.registers
        registers[:] = bytes(128)
        registers[reg.PWR_MGMT_1] = self.profile.power_reset
        registers[reg.WHO_AM_I] = self.profile.who_am_i
        self.trim.load(registers)
        self.fifo.clear()
        self._fresh = False
        self._sampler.switch(False, self.now_ns)
        self._accel.zero()
        self._gyro.zero()
        self._pin.clear()
        self._configure()

    def _configure(self):
        """Derive everything from the registers; samples up to now are already computed."""
        registers, sampler, now_ns = self.registers, self._sampler, self.now_ns
        settings = Settings(registers, self.profile, self.trim)
        self._outputs = settings
        self._accel.added = _sum(self._overload[0], settings.self_test_g)
        self._gyro.added = _sum(self._overload[1], settings.self_test_dps)
        power = registers[reg.PWR_MGMT_1]
        if power & _CYCLE:
            sampler.every = 1
            sampler.set_cycle(settings.cycle_hz(), settings.limits, now_ns)
        else:
            rows = settings.filter_rows()
            # RM-MPU-6500A p. 12: behind the 8 kHz filters the divider does nothing there
            undivided = self.profile.accel_filter_register is not None and rows[0][2] == 8000
            sampler.every = 1 if undivided else 1 + registers[reg.SMPLRT_DIV]
            sampler.set_rows(*rows, settings.limits, now_ns)
        awake = self._powered and not power & _SLEEP and power & 7 != _CLK_STOPPED
        sampler.switch(awake, now_ns)
        enabled = registers[reg.INT_ENABLE]
        self._fifo_on = bool(registers[reg.USER_CTRL] & _FIFO_ON and registers[reg.FIFO_EN])
        self._watches = bool(enabled & reg.MOT and self.profile.motion_engine)
        self._eager = self._watches or (self._fifo_on and bool(enabled & reg.FIFO_OFLOW))
        self._announced = sampler.tick(now_ns) if sampler.running else 0
        self._plan(now_ns)

    # samples

    def _sync(self, t_ns):
        """Compute the samples up to `t_ns` and put the last one into the output registers."""
        on_output = self._output if self._fifo_on or self._eager else None
        on_accel = self._watch if self._watches else None
        if self._sampler.run(t_ns, on_output, on_accel):
            self._fresh = True
        if self._fresh and not self._held():
            self._fresh = False
            self._outputs.put(self._sampler.output, self.registers)

    def _held(self):
        return self._frozen

    def _watch(self, t_ns):
        if self._engine.step(self._accel.value):
            self._trigger(reg.MOT, t_ns)

    def _output(self, t_ns):
        """An output sample that somebody inside the chip sees: FIFO and interrupt."""
        if self._fifo_on:
            scratch = bytearray(128) if not self._frozen else self.registers[:]
            if not self._frozen:
                self._outputs.put(self._sampler.output, scratch)
            stops = self.profile.fifo_can_stop and self.registers[reg.CONFIG] & _FIFO_STOPS
            if self.fifo.push(packet(scratch, self.registers[reg.FIFO_EN]), stops):
                self._trigger(reg.FIFO_OFLOW, t_ns)
        if self._eager:
            self._trigger(reg.DATA_RDY, t_ns)


def _sum(a, b):
    return tuple(u + v for u, v in zip(a, b))
