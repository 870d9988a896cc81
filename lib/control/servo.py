# SPDX-License-Identifier: MIT
"""A hobby servo on a PWM pin, calibrated by its end points."""

import micropython
from micropython import const

_HZ = const(50)


class Servo:
    """Angle in millidegrees to pulse length; nothing is allocated after construction.

    pwm: MicroPython's machine.PWM or what has its freq() and duty_ns().
    pulse_us: pulse lengths in microseconds at the two ends; angle_deg: the angles there,
    measured on the servo at hand (a swapped pair turns the direction round).
    slew_dps: the fastest movement asked for, in deg/s at the given update rate rate_hz; None
    for no limit. The first write goes where it is told to.
    """

    def __init__(self, pwm, pulse_us=(1000, 2000), angle_deg=(-45.0, 45.0), slew_dps=None,
                 rate_hz=_HZ):
        low, high = angle_deg
        if low == high or not 0 < pulse_us[0] < pulse_us[1] <= 3000:
            raise ValueError("servo: two different angles, pulses rising within 1 to 3000 us")
        if low > high:
            low, high = high, low
        self._low = int(low * 1000)
        self._high = int(high * 1000)
        # ns per mdeg in 1/1024, so that the product below stays a small int of 31 bits
        self._slope = round(1024 * (pulse_us[1] - pulse_us[0]) / (angle_deg[1] - angle_deg[0]))
        self._mid_mdeg = (self._low + self._high) // 2
        self._mid_ns = round((pulse_us[0] + pulse_us[1]) * 500)
        if abs(self._slope) * (self._high - self._mid_mdeg) >= 1 << 30:
            raise ValueError("servo: range too wide for its pulse range")
        self._step = None if slew_dps is None else int(slew_dps * 1000 / rate_hz)
        self._duty_ns = pwm.duty_ns  # a bound method made once: looking it up allocates
        self.angle_mdeg = None
        pwm.freq(_HZ)

    @micropython.native
    def write(self, angle_mdeg):
        """Go towards this angle; returns the angle commanded, in mdeg, within range and slew."""
        angle = min(max(angle_mdeg, self._low), self._high)
        step, last = self._step, self.angle_mdeg
        if step is not None and last is not None:
            angle = min(max(angle, last - step), last + step)
        self.angle_mdeg = angle
        self._duty_ns(self._mid_ns + ((angle - self._mid_mdeg) * self._slope >> 10))
        return angle

    def release(self):
        """No more pulses: the servo lets go. The next write is not slew-limited."""
        self.angle_mdeg = None
        self._duty_ns(0)
