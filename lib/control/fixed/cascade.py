# SPDX-License-Identifier: MIT
"""Three integer cascades for a quadcopter: an angle loop around a rate loop on each axis."""

from array import array

import micropython

from control.fixed.pid import encode, lag, output_range, put_gains, steps


# Rate wanted = gain (target - angle), within +-limit; the inner error and the change of the rate
# go to the arrays that steps() works on. The coefficients' layout is described there.
@micropython.viper
def _outer(coef: ptr32, state: ptr32, limit: int, target: ptr32, angle: ptr32, counts: ptr16,
           error: ptr32, change: ptr32):
    axis = 0
    while axis < 3:
        c = axis << 4
        s = axis << 2
        x = int(target[axis]) - int(angle[axis])  # mdeg, the short way round
        if x > 180000:
            x -= 360000
        elif x < -180000:
            x += 360000
        if x > 180000:
            x = 180000
        elif x < -180000:
            x = -180000
        g = int(coef[c + 13])
        x = x << int(coef[c + 14])
        r = int(coef[c + 15])
        wanted = ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + ((1 << r) >> 1)) >> r
        if wanted > limit:
            wanted = limit
        elif wanted < 0 - limit:
            wanted = 0 - limit
        v = int(counts[axis + 4])
        if v > 32767:
            v -= 65536  # ptr16 loads without a sign
        error[axis] = wanted - v
        change[axis] = v - int(state[s + 2])
        state[s + 2] = v
        axis += 1


class Cascade:
    """Three axes: an angle loop (P) around a rate loop (PID) each, for a quadcopter.

    angle_gains: three, deg/s wanted per degree of error. rate_gains: three (kp, ki, kd), output
    units per deg/s, per degree, per deg/s^2; the derivative acts on the measured rate. limit:
    of each output. lsb_per_dps belongs to the gyro range of the counts.
    """

    def __init__(self, angle_gains, rate_gains, limit, rate_hz=1000, lsb_per_dps=65.5,
                 rate_limit_dps=220, tau_d_s=0.003):
        self._limit = int(rate_limit_dps * lsb_per_dps)
        if not 0 < self._limit <= 32767:
            raise ValueError("rate_limit_dps %s is beyond the gyro's range" % rate_limit_dps)
        self._coef = array("i", [0] * 48)
        self._state = array("i", [0] * 12)
        self._error = array("i", [0] * 3)
        self._change = array("i", [0] * 3)
        self.out = array("i", [0] * 3)
        for axis in range(3):
            at = axis * 16
            kp, ki, kd = rate_gains[axis]
            put_gains(self._coef, at, kp / lsb_per_dps, ki / lsb_per_dps,
                   kd / lsb_per_dps * rate_hz, rate_hz, 65535)
            self._coef[at + 9] = lag(tau_d_s, rate_hz)
            self._coef[at + 10], self._coef[at + 11] = output_range(limit)
            outer = encode(angle_gains[axis] * lsb_per_dps / 1000, 180000)
            for k in range(3):
                self._coef[at + 13 + k] = outer[k]

    def reset(self):
        """Forget integrals and past rates."""
        for k in range(12):
            self._state[k] = 0

    def update(self, target_mdeg, angle_mdeg, counts):
        """One step into self.out; arrays 'i' of roll, pitch, yaw, and the sensor's counts."""
        _outer(self._coef, self._state, self._limit, target_mdeg, angle_mdeg, counts,
               self._error, self._change)
        steps(3, self._coef, self._state, self._error, self._change, self.out)
