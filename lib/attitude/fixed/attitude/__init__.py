# SPDX-License-Identifier: MIT
"""The integer twin of attitude.Attitude: one viper call from raw counts to millidegrees.

Its numbers stand in one array of 32-bit integers that six files share. A constant of viper code
must be local to its file to be free, so what stands once is this list, and a test holds every
const() of the folder against it. "inc" is a rate times dt / 4 in 2^-30 rad, "sum" is inc times
samples, Qn a number times 2^n; spans of time are counts of blocks. Written by: set (set-up and
calibration), step, slow, view (bias_view), level.

place    name        format and meaning                                              written by
0-11     -           Q14: accelerometer's 9 coefficients, 3 offsets (folding)               set
12-23    -           gyro's 9 coefficients, 3 offsets to inc, over 2^GYRO_SHIFT             set
24       GYRO_SHIFT  how far the gyro's sums are shifted down                               set
25       E_SHIFT     counts * 2^13 >> E_SHIFT is g * 2^24                                   set
26       LAG_PRE     lag_s * rate, an angle Q15, is (inc >> LAG_PRE) * LAG >> LAG_POST      set
27       LAG         see LAG_PRE                                                            set
28       LAG_POST    see LAG_PRE                                                            set
29       ONE         2^30, which is no small integer                                        set
30       K           gain * dt is K / 2^(15 + K_SHIFT), K below 2^15; state begins here    slow
31       K_SHIFT     see K                                                         set, slow
32       K_HALF      2^(K_SHIFT - 1), to round                                             slow
33       COUNT       samples in this block: the first one has one, and levels      set, slow
34       W           quaternion, sensor to earth, Q30                 set, step, slow, level
35       X           the same                                                 step, slow, level
36       Y           the same                                                 step, slow, level
37       Z           the same                                                 step, slow, level
38       TRIM        (|q|^2 - 1) / 2, Q18: what the next sample takes off           step, level
39-41    LAST        inc of the last sample without bias                                   step
42-44    BIAS        inc Q8                                                          slow, view
45-47    -           the bias's fraction that waits, Q8                                    step
48       VX          velocity that should not be there, g * 2^24                     step, slow
49       VY          the same                                                        step, slow
50       PX          position that should not be there, g * 2^24                     step, slow
51       PY          the same                                                        step, slow
52       LEFT        samples until the block is full                         set, step, slow
53       OVER        the gyro was over its range in this block                       step, slow
54-59    SUM         of the block: inc with the bias in it, calibrated counts        step, slow
60-61    ROLL        mdeg, then the pitch                                                  step
62       YAW         mdeg                                                                  step
63-68    MEAN        sums of the last half second, the accelerometer's in Q6               slow
69-71    HOME        the bias as last seen at rest, sum                                    slow
72-74    HOME_BIAS   the same, inc Q8                                                      slow
75-77    UP          acceleration in the earth frame, counts * samples                     slow
78       UP_SAMPLES  how many are in it                                                    slow
79       AGE         since the start, or since the attitude was lost                       slow
80       STILL       for how long it has been still, at most REST                          slow
81       RESTED      for how long it has been at rest, at most RESTED_MAX                  slow
82       LEARNED     it has rested once                                                    slow
83       MOVED       it has moved since the start                                          slow
84       SPEED       sum of the axes' |rate| over some seconds, sum                        slow
85       KNOWN       how long the bias has been watched                              slow, view
86       GAIN        gain * dt, Q24                                                        slow
87-92    TILT        Q24: earth x in sensor axes, earth y in sensor axes, filtered   slow, view
93-98    VELOCITY    Q24, of the same filter                                         slow, view
99-104   POSITION    Q24, of the same filter; state ends here                        slow, view
105      N           samples in a block; from here to the end in the order of set_up        set
106      MEAN_K      Q15                                                                    set
107      STILL_GYRO  sum                                                                    set
108      STILL_ACCEL counts * samples, Q6                                                   set
109-110  LIMIT       sum: bias that is believed before and after the first rest             set
111-112  LIMIT_BIAS  the same, inc Q8                                                       set
113      REST        how long it must be still                                              set
114      RESTED_MAX  averaging time of the bias at rest                                     set
115      YOUNG       how long the mean alone levels                                         set
116      RAMP        gain * dt, Q24, times age                                              set
117      K_MOTION    gain * dt, Q24                                                         set
118      K_REST      the same                                                               set
119      HALF_G      counts                                                                 set
120      QUICK       5 s                                                                    set
121      KNOWN_MAX   time constant of the bias in motion                                    set
122      LEARN_AGE   from when on the bias is learned in motion                             set
123      LOST        samples in 2 s                                                         set
124      SPEED_K     Q15                                                                    set
125      FAST        speed to gain * dt, Q24: times FAST / 2^15 >> FAST_SHIFT               set
126      FAST_SHIFT  see FAST                                                               set
127      VIEW_AT     LEFT at which the view of the bias follows                             set
"""

from math import sqrt

from micropython import const

from attitude.fixed.attitude.coefficients import set_up
from attitude.fixed.attitude.step import step
from attitude.fixed.base import Fixed

_GYRO_SHIFT = const(24)
_LAG_PRE = const(26)
_LAG = const(27)
_LAG_POST = const(28)
_STATE = const(30)
_W = const(34)
_LAST = const(39)
_BIAS = const(42)
_ROLL = const(60)
_YAW = const(62)
_STILL = const(80)
_STATE_END = const(105)
_REST = const(113)
_SIZE = const(128)
# what a gap leaves: the quaternion, the bias, the bias as seen at rest, and what is known of it
_KEPT = ((34, 38), (42, 45), (69, 75), (81, 84), (85, 86))


class Attitude(Fixed):
    """Roll, pitch and relative yaw in millidegrees for free motion, from raw counts.

    rate_hz: any real rate, 80 to 1000; gyro_dps, accel_g: the ranges that the counts come in.
    Further settings by name, as for the float Attitude: tau_s, fast_dps, rest_tau_s, bias_tau_s,
    rest_bias_s, rest_s, rest_gyro_dps, rest_accel_g, bias_limit_dps, start_bias_dps, lag_s.
    The algorithm is described there. The angles are ready when update() returns.
    """

    _gyro_rows = 3
    _unit_per_deg = 4685077.9  # 2^30 / 4 in radians
    _shift_at = _GYRO_SHIFT
    _state_at = _STATE
    _state_end = _STATE_END
    _angles_at = _ROLL
    _least_hz = 40  # so that a block of samples is no longer than 25 ms

    def __init__(self, rate_hz=250, gyro_dps=500, accel_g=8, **settings):
        super().__init__(rate_hz, gyro_dps, accel_g, _SIZE)
        set_up(self._s, rate_hz, gyro_dps, accel_g, **settings)
        self._start = self.state()

    update = step

    def reset(self):
        """Forget everything; the next sample starts anew with yaw 0."""
        self.set_state(self._start)

    def relevel(self):
        """After a gap: the next samples level anew; yaw and what is known of the bias stay."""
        s = self._s
        kept = tuple(s)
        self.reset()
        for first, end in _KEPT:
            for i in range(first, end):
                s[i] = kept[i]

    @property
    def yaw_mdeg(self):
        """Rotation about the vertical since the start, millidegrees, -180000 to 180000."""
        return self._s[_YAW]

    @property
    def at_rest(self):
        """True when it has stood still for rest_s."""
        return self._s[_STILL] >= self._s[_REST]

    @property
    def bias_dps(self):
        """Gyro bias as estimated on top of the calibration, deg/s (makes floats)."""
        scale = self.rate_hz / (self._unit_per_deg * 256.0)
        return tuple([b * scale for b in self._s[_BIAS : _BIAS + 3]])

    def quaternion(self):
        """(w, x, y, z), sensor to earth, for now: turned on by lag_s at the last rate (floats)."""
        s = self._s
        w, x, y, z = [v / 1073741824.0 for v in s[_W : _W + 4]]
        half = s[_LAG] / (1 << s[_LAG_PRE]) / (1 << s[_LAG_POST]) / 65536.0
        a, b, c = [v * half for v in s[_LAST : _LAST + 3]]
        w, x, y, z = (
            w - x * a - y * b - z * c,
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
        )
        n = sqrt(w * w + x * x + y * y + z * z)
        return (w / n, x / n, y / n, z / n)
