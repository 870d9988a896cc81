# SPDX-License-Identifier: MIT
"""Motor controllers (ESC) on PWM pins, with arming and a safe state."""

import micropython


@micropython.viper
def _write(self, commands: ptr32):
    """One command per motor, 0..1000; nothing is allocated. Stopped unless armed."""
    if not self.armed:
        self.safe()
        return
    idle = int(self.idle)
    stop = int(self._stop_ns)
    span = int(self._span_us)  # ns per permille
    writers = self._writers
    n = int(self._n)
    k = 0
    while k < n:
        command = commands[k]
        if command < idle:
            command = idle
        elif command > 1000:
            command = 1000
        writers[k](stop + command * span)
        k += 1


class Escs:
    """Several ESCs by pulse length; starts disarmed. write() takes an array 'i' of permille.

    pwms: objects with machine.PWM's freq() and duty_ns(). Standard ESCs take 1000 to 2000 us at
    up to 400 pulses a second; idle is the least command while armed, so that no motor stops.
    """

    def __init__(self, pwms, pulse_us=(1000, 2000), freq_hz=400, idle=50):
        if pulse_us[1] * freq_hz > 1000000:
            raise ValueError("ESC: pulses of %d us do not fit %d Hz" % (pulse_us[1], freq_hz))
        for pwm in pwms:
            pwm.freq(freq_hz)
        self._writers = [pwm.duty_ns for pwm in pwms]
        self._n = len(self._writers)
        self._stop_ns = pulse_us[0] * 1000
        self._span_us = pulse_us[1] - pulse_us[0]
        self.idle = idle
        self.armed = False
        self.safe()

    def arm(self, throttle, tilt_mdeg=0):
        """Allow the motors to turn, if the throttle is at zero and the frame near level.

        Raises ValueError with the reason otherwise: what a careless finger must not start.
        """
        if throttle > 0:
            raise ValueError("not armed: throttle %d, must be 0" % throttle)
        if abs(tilt_mdeg) > 25000:
            raise ValueError("not armed: tilted by %d degrees" % (tilt_mdeg // 1000))
        self.armed = True

    write = _write

    @micropython.native
    def safe(self):
        """Stop all motors and disarm: the fail-safe value. May be called at any time."""
        self.armed = False
        for writer in self._writers:
            writer(self._stop_ns)
