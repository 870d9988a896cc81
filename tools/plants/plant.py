# SPDX-License-Identifier: MIT
"""What all plants share: integration in small steps, the pulses of the board, the log."""

import numpy as np


class Pulses:
    """The pulse length (us) that a PWM output of the Port carries at an instant.

    The output latches a new length at the start of its next period, as the timers of the boards
    do; before the first it is 0 (no pulse).
    """

    def __init__(self, port, pin):
        self._port = port
        self._pin = pin
        self._history = None
        self._place = 0
        self._value = 0.0
        self._frame = -1

    def us(self, t_s):
        """Length at time t_s; calls come in order of time."""
        pwm = self._port.pin(self._pin).pwm
        if pwm is None or not pwm.history:
            return 0.0
        history = pwm.history
        hz = history[-1][1] or 50
        frame = int(t_s * hz)
        if frame != self._frame:
            self._frame = frame
            t_ns = frame / hz * 1e9
            for entry in reversed(history):
                if entry[0] <= t_ns:
                    self._value = entry[2] / 65535 / hz * 1e6
                    break
        return self._value


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
