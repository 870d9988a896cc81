# SPDX-License-Identifier: MIT
"""The whole control of a quadcopter in one viper call: angle loops, rate loops, mixer.

Per axis: rate wanted = gain (target - angle), limited; then a PID on the rate, its derivative on
the measured rate; see control.fixed.pid for the format of the gains and the anti-windup. The
mixer's law, motors and signs are control.mixer's. Units: millidegrees, millidegrees per second
(inside in 16ths of them, 16 bits: rates beyond 524 deg/s count as that), permille.
"""

from array import array

import micropython
from micropython import const

from control.fixed.pid import encode, lag, output_range, put_gains

# Words of the array: 0-2 target, 6 limit of the rate wanted, 7 saturated, 8-10 torque,
# 11-14 motors; then 20 for each axis: 16 of coefficients as in control.fixed.pid (13-15 the outer
# gain) and 4 of state: 16 integral << 10, 17 low-passed change of the rate << 6, 18 last rate.
_LIMIT = const(6)
_SATURATED = const(7)
_TORQUE = const(8)
_MOTORS = const(11)
_AXES = const(16)
_SIZE = const(76)
_LSB_PER_DPS = const(62.5)


@micropython.viper
def _update(self, throttle: int, angles: ptr32, rates: ptr32):
    """One step: throttle 0..1000; roll, pitch, yaw in mdeg; rates in mdeg/s -> self.motors."""
    s = ptr32(self._s)
    limit = s[6]
    axis = 0
    c = _AXES
    while axis < 3:
        x = s[axis] - angles[axis]
        if x > 180000:  # the short way round
            x -= 360000
        elif x < -180000:
            x += 360000
        if x > 180000:
            x = 180000
        elif x < -180000:
            x = -180000
        x = x << s[c + 14]
        g = s[c + 13]
        x = ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + (1 << s[c + 15] >> 1)) >> s[c + 15]
        if x > limit:
            x = limit
        elif x < 0 - limit:
            x = 0 - limit
        v = rates[axis] >> 4
        if v > 32767:
            v = 32767
        elif v < -32768:
            v = -32768
        e = x - v

        d = s[c + 17]
        x = ((v - s[c + 18]) << 6) - d
        s[c + 18] = v
        g = s[c + 9]
        d += (x >> 15) * g + (((x & 0x7FFF) * g) >> 15)
        s[c + 17] = d

        x = e << s[c + 1]
        g = s[c + 0]
        u = ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + (1 << s[c + 2] >> 1)) >> s[c + 2]
        x = ((d + 32) >> 6) << s[c + 7]
        g = s[c + 6]
        u -= ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + (1 << s[c + 8] >> 1)) >> s[c + 8]
        x = e << s[c + 4]
        g = s[c + 3]
        i = ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + (1 << s[c + 5] >> 1)) >> s[c + 5]
        x = s[c + 16] + i
        if x > s[c + 11] << 10:
            x = s[c + 11] << 10
        elif x < s[c + 10] << 10:
            x = s[c + 10] << 10
        u += x >> 10
        if u > s[c + 11]:  # at the limit the integral may only move back: no wind-up
            u = s[c + 11]
            if i > 0:
                x = s[c + 16]
        elif u < s[c + 10]:
            u = s[c + 10]
            if i < 0:
                x = s[c + 16]
        s[c + 16] = x
        s[axis + 8] = u
        axis += 1
        c += 20

    # mixer
    x = s[8]
    v = s[9]
    u = s[10]
    s[7] = 0
    e = x if x >= 0 else 0 - x
    d = v if v >= 0 else 0 - v
    if e + d > 500:
        g = e + d
        x = x * 500 // g
        v = v * 500 // g
        e = x if x >= 0 else 0 - x
        d = v if v >= 0 else 0 - v
        s[7] = 1
    g = 500 - (e if e > d else d)  # room for yaw
    if u > g:
        u = g
        s[7] = 1
    elif u < 0 - g:
        u = 0 - g
        s[7] = 1
    m1 = 0 - x + v + u
    m2 = 0 - x - v - u
    m3 = x + v - u
    m4 = x - v + u
    d = m1 if m1 < m2 else m2
    if m3 < d:
        d = m3
    if m4 < d:
        d = m4
    e = m1 if m1 > m2 else m2
    if m3 > e:
        e = m3
    if m4 > e:
        e = m4
    if throttle + d < 0:
        throttle = 0 - d
    if throttle + e > 1000:
        throttle = 1000 - e
    motors = ptr32(self.motors)
    motors[0] = m1 + throttle
    motors[1] = m2 + throttle
    motors[2] = m3 + throttle
    motors[3] = m4 + throttle


class QuadControl:
    """Angles and rates to four motor commands.

    angle_gains: three (roll, pitch, yaw), deg/s wanted per degree of error. rate_gains: three (kp,
    ki, kd), permille per deg/s, per degree, per deg/s^2. limit: of each torque, permille, at most
    1000. `motors` (array 'i') has the result, -1 to 1001 after rounding; `torque` what the loops
    asked for.
    """

    def __init__(self, angle_gains, rate_gains, limit=400, rate_hz=1000, rate_limit_dps=220,
                 tau_d_s=0.003):
        lsb_per_dps = _LSB_PER_DPS
        self._s = s = array("i", [0] * _SIZE)
        self.motors = array("i", [0] * 4)
        s[_LIMIT] = int(rate_limit_dps * lsb_per_dps)
        if not 0 < s[_LIMIT] <= 32767:
            raise ValueError("rate_limit_dps %s is beyond the gyro's range" % rate_limit_dps)
        if not 0 < limit <= 1000:
            raise ValueError("limit %s: 1 to 1000 permille" % limit)
        for axis in range(3):
            at = _AXES + axis * 20
            kp, ki, kd = [k / lsb_per_dps for k in rate_gains[axis]]
            put_gains(s, at, kp, ki, kd * rate_hz, rate_hz, 65535)
            s[at + 9] = lag(tau_d_s, rate_hz)
            s[at + 10], s[at + 11] = output_range(limit)
            outer = encode(angle_gains[axis] * lsb_per_dps / 1000, 180000)
            for k in range(3):
                s[at + 13 + k] = outer[k]

    update = _update

    def target(self, roll_mdeg, pitch_mdeg, yaw_mdeg):
        """Angles to hold."""
        s = self._s
        s[0] = roll_mdeg
        s[1] = pitch_mdeg
        s[2] = yaw_mdeg

    def go_on_from(self, old):
        """Its targets, integrals and past rates, for the same motors; None: from nothing."""
        if old is None:
            return
        for place in range(3):
            self._s[place] = old._s[place]
        for axis in range(3):
            for k in range(16, 19):
                self._s[_AXES + axis * 20 + k] = old._s[_AXES + axis * 20 + k]

    @property
    def torque(self):
        """Roll, pitch, yaw torque asked for by the loops, permille (makes a tuple)."""
        return tuple(self._s[_TORQUE : _TORQUE + 3])

    @property
    def saturated(self):
        """True when the last command did not fit the motors as it was."""
        return self._s[_SATURATED] != 0

    def reset(self):
        """Forget integrals and past rates."""
        for axis in range(3):
            for k in range(16, 19):
                self._s[_AXES + axis * 20 + k] = 0
