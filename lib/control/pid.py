# SPDX-License-Identifier: MIT
"""PID controllers in float: positional and velocity form.

Forms and their names after K. J. Astrom, R. M. Murray, Feedback Systems, chapter 10 (derivative
on measurement, filtered derivative, anti-windup, bumpless parameter changes).
"""


def limits(limit):
    """(low, high) from None, a number for +-limit, or a (low, high) pair."""
    if limit is None:
        return -1e30, 1e30
    low, high = (-limit, limit) if isinstance(limit, (int, float)) else limit
    if low >= high:
        raise ValueError("limit (%s, %s): low must be below high" % (low, high))
    return low, high


class PID:
    """output = kp error + integral(ki error dt) - kd d(measurement)/dt, within limit.

    kp: output units per unit of error; ki: the same per second; kd: the same times seconds.
    limit: None, +-limit, or (low, high). tau_d_s: time constant of the derivative's low-pass in
    seconds; 0 turns it off. All but the limit may be set while it runs; tune() does so without
    a jump of the output.
    """

    def __init__(self, kp, ki, kd, limit=None, tau_d_s=0.0):
        self.kp = kp
        self.ki = ki
        self.kd = kd
        self.low, self.high = limits(limit)
        self.tau_d_s = tau_d_s
        self.reset()

    def reset(self, output=0.0):
        """Forget the past; the integral starts so that zero error gives this output."""
        self.integral = min(max(output, self.low), self.high)
        self.output = self.integral
        self._derivative = 0.0
        self._error = 0.0
        self._last = None

    def tune(self, kp=None, ki=None, kd=None):
        """New gains without a jump: the integral takes over what the others give up.

        Without an integral (ki 0) nothing could ever take that offset back, so the output jumps.
        """
        kp = self.kp if kp is None else kp
        kd = self.kd if kd is None else kd
        if ki is not None:
            self.ki = ki  # the integral is kept in output units, so ki itself makes no jump
        if self.ki != 0.0:
            self.integral += (self.kp - kp) * self._error + (kd - self.kd) * self._derivative
        self.kp = kp
        self.kd = kd

    def update(self, error, dt_s, measurement=None, rate=None):
        """One step -> output within the limit; error = target - measurement, dt_s in seconds.

        The derivative is taken from `rate` (the measured derivative of the measurement, a gyro's
        deg/s for example) if given, else from the differences of `measurement`, so that a step
        of the target gives no kick; with neither, from those of -error. An error that is not a
        finite number leaves the output as it is.
        """
        if error - error != 0.0:  # inf or nan
            return self.output
        if rate is None:
            value = -error if measurement is None else measurement
            rate = self._derivative
            if self._last is not None and dt_s > 0.0:
                rate = (value - self._last) / dt_s
            self._last = value
        if self.tau_d_s > 0.0:
            rate = self._derivative + (rate - self._derivative) * dt_s / (self.tau_d_s + dt_s)
        self._derivative = rate
        self._error = error
        step = self.ki * error * dt_s
        integral = min(max(self.integral + step, self.low), self.high)
        output = self.kp * error - self.kd * rate + integral
        # at the limit the integral may only move back: no wind-up
        if output > self.high:
            output = self.high
            if step > 0.0:
                integral = self.integral
        elif output < self.low:
            output = self.low
            if step < 0.0:
                integral = self.integral
        self.integral = integral
        self.output = output
        return output


class VelocityPID:
    """The same law in velocity form: each step adds its increment to the output.

    For commands that are increments by nature, such as a servo whose own movement the sensor
    sees: there is no integral to wind up, gains may change at any time without a jump, and
    set the start with reset(output). Gains and limit as PID's.
    """

    def __init__(self, kp, ki, kd, limit=None):
        self.kp = kp
        self.ki = ki
        self.kd = kd
        self.low, self.high = limits(limit)
        self.reset()

    def reset(self, output=0.0):
        """Continue from this output, as if at rest."""
        self.output = min(max(output, self.low), self.high)
        self._measurement = None
        self._rate = 0.0

    def update(self, error, dt_s, measurement=None):
        """One step -> output; all but the integral act on the measurement (-error if None)."""
        if error - error != 0.0:  # inf or nan
            return self.output
        value = -error if measurement is None else measurement
        step = self.ki * error * dt_s
        if self._measurement is not None and dt_s > 0.0:
            moved = value - self._measurement
            rate = moved / dt_s
            step -= self.kp * moved + self.kd * (rate - self._rate)
            self._rate = rate
        self._measurement = value
        self.output = min(max(self.output + step, self.low), self.high)
        return self.output
