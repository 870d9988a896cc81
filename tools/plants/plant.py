# SPDX-License-Identifier: MIT
"""What all plants share: integration in small steps, the pulses of the board, the log."""

import numpy as np


class Pulses:
    """What a PWM output of the Port carries at an instant; calls come in order of time.

    The output takes a new length at the start of its next period, as the timers of the boards
    do; before the first it is 0 (no pulse).
    """

    def __init__(self, port, pin):
        self._port = port
        self._pin = pin
        self._duty = 0.0
        self._hz = 50
        self._frame = -1

    def duty(self, t_s):
        """Share of the period that is high at t_s, 0 to 1."""
        pwm = self._port.pin(self._pin).pwm
        if pwm is None or not pwm.history:
            return 0.0
        history = pwm.history
        self._hz = history[-1][1] or 50
        frame = int(t_s * self._hz)
        if frame != self._frame:
            self._frame = frame
            t_ns = frame / self._hz * 1e9
            for at_ns, _, duty_u16 in reversed(history):
                if at_ns <= t_ns:
                    self._duty = duty_u16 / 65535
                    break
        return self._duty

    def us(self, t_s):
        """Length of the pulse at t_s, microseconds."""
        return self.duty(t_s) / self._hz * 1e6


class Plant:
    """A subclass gives `_step(t_s, dt_s)`, which sets `sample` (force g, rate dps), `quaternion`
    and returns a row for the log (`columns` names it)."""

    STEP_S = 0.0005
    duration_s = None
    columns = ()

    def __init__(self):
        self._n = 0
        self.sample = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        self.quaternion = (1.0, 0.0, 0.0, 0.0)
        self._rows = []

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC) at t_s, never before the last t_s."""
        last = int(t_s / self.STEP_S + 1e-6)
        while self._n < last:
            self._n += 1
            self._rows.append(self._step(self._n * self.STEP_S, self.STEP_S))
        return (*self.sample, 25.0)

    def truth(self, _t_s):
        """Attitude now, sensor to earth."""
        return self.quaternion

    def log(self):
        """{name: array} over time, `t_s` with it."""
        rows = np.array(self._rows)
        out = {name: rows[:, k] for k, name in enumerate(self.columns)}
        out["t_s"] = (np.arange(len(rows)) + 1) * self.STEP_S
        return out
