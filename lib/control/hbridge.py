# SPDX-License-Identifier: MIT
"""A DC motor on an H-bridge with two PWM inputs (DRV8833, L298 and their like)."""

import micropython


class HBridge:
    """Drive in permille of the supply, -1000 to 1000; nothing is allocated after construction.

    forward, backward: machine.PWM or what has its freq() and duty_u16(). One of them carries the
    pulses, the other stays low; both low lets the motor coast.
    """

    def __init__(self, forward, backward, freq_hz=20000):
        for pwm in (forward, backward):
            pwm.freq(freq_hz)
        self._forward = forward.duty_u16
        self._backward = backward.duty_u16
        self.stop()

    @micropython.native
    def write(self, drive):
        """Set the drive; beyond +-1000 it is clipped."""
        if drive >= 0:
            self._backward(0)
            self._forward(min(drive, 1000) * 65535 // 1000)
        else:
            self._forward(0)
            self._backward(min(-drive, 1000) * 65535 // 1000)

    @micropython.native
    def stop(self):
        """Coast."""
        self._forward(0)
        self._backward(0)
