# SPDX-License-Identifier: MIT
"""The integer twin of Complementary."""

from array import array

import micropython
from micropython import const

from attitude.fixed.folding import check_rate

_ANGLE = const(0)  # 1/2048 millidegree: 180 degrees are 2^28.5
_GAIN = const(1)  # 1 - alpha, Q15
_DT = const(2)  # mdeg/s to 1/2048 millidegree per sample, times 2^SHIFT, 15 bits
_DT_SHIFT = const(3)
_GAIN_SHIFT = const(4)
_MOST = const(5)


class Complementary:
    """Angle of one axis in millidegrees; settings as the float one, for a fixed rate.

    tau_s: time constant in seconds; alpha per sample is used as it stands when tau_s is None.
    rate_hz: 10 to 2000. Within 5 millidegrees of the float twin.
    """

    def __init__(self, alpha=0.98, tau_s=None, rate_hz=250):
        check_rate(rate_hz, 0)
        if tau_s is not None:
            alpha = tau_s / (tau_s + 1.0 / rate_hz)
        if not 0.0 <= alpha <= 1.0:
            raise ValueError("alpha %s: must be within 0 and 1" % alpha)
        dt = 2048.0 / rate_hz
        shift = 0
        while dt * (2 << shift) < 32768.0:
            shift += 1
        # the gain in two steps: 1 - alpha may be far below 2^-15
        fine = 0
        while fine < 14 and (1.0 - alpha) * (2 << fine) <= 1.0:
            fine += 1
        gain = int((1.0 - alpha) * (32768 << fine) + 0.5)
        most = int(min(4e6, 1.7e5 * rate_hz))  # mdeg/s: no sensor's, and under half a turn
        self._s = array("i", (0, gain, int(dt * (1 << shift) + 0.5), shift, fine, most))

    def reset(self, angle_mdeg=0):
        """Continue from this angle; give the first accelerometer angle to start on it."""
        self._s[_ANGLE] = angle_mdeg * 2048

    def state(self):
        """What set_state() takes to continue here."""
        return self._s[_ANGLE]

    def set_state(self, state):
        """Continue from a state()."""
        self._s[_ANGLE] = state

    @micropython.viper
    def update(self, accel_mdeg: int, rate_mdps: int) -> int:
        """Angle (within +-180000) and rate in milli-units -> angle in millidegrees.

        A rate beyond +-4000 deg/s, or 170 degrees a sample, is cut.
        """
        s = ptr32(self._s)
        if rate_mdps > s[_MOST]:
            rate_mdps = s[_MOST]
        elif rate_mdps < 0 - s[_MOST]:
            rate_mdps = 0 - s[_MOST]
        # 22 bits by 15 bits
        t = (rate_mdps >> 11) * s[_DT] + ((rate_mdps & 0x7FF) * s[_DT] >> 11)
        n = s[_DT_SHIFT] - 11
        a = s[_ANGLE] + (t >> n if n >= 0 else t << 0 - n)
        t = (accel_mdeg << 11) - a
        if t > 368640000:
            t -= 737280000
        elif t < -368640000:
            t += 737280000
        a += ((t >> 15) * s[_GAIN] + ((t & 0x7FFF) * s[_GAIN] >> 15)) >> s[_GAIN_SHIFT]
        if a > 368640000:
            a -= 737280000
        elif a < -368640000:
            a += 737280000
        s[_ANGLE] = a
        return (a + 1024) >> 11
