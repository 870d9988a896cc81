# SPDX-License-Identifier: MIT
"""The integer twin of attitude.Attitude: one viper call from raw counts to millidegrees.

Its numbers stand in one array of 32-bit integers that these files share. A constant of viper code
must be local to its file to be free, so what stands once is this list, and a test holds every
const() of the folder against it. "inc" is a rate times the nominal dt / 4 in 2^-30 rad, "sum" is
inc times samples, Qn a number times 2^n; spans of time are counts of blocks. Written by: set
(coefficients and base: set-up, calibration, period), view (bias_view), and files of that name.

place    name        format and meaning                                              written by
0-11     ACCEL       Q14: accelerometer's 9 coefficients, 3 offsets (folding)               set
12-23    GYRO        9 coefficients, 3 offsets, to inc times 2^GYRO_SHIFT                   set
24       GYRO_SHIFT  how far the gyro's sums are shifted down                               set
25       STEP        the period by the nominal one, Q15                                     set
26       RATE        mdps are inc times RATE / 2^15 >> RATE_SHIFT                           set
27       RATE_SHIFT  see RATE                                                               set
28       E_SHIFT     counts * 2^13 >> E_SHIFT is g * 2^24                                   set
29       LAG_PRE     lag_s * rate, an angle Q15, is (inc >> LAG_PRE) * LAG >> LAG_POST      set
30       LAG         see LAG_PRE                                                            set
31       LAG_POST    see LAG_PRE                                                            set
32       ONE         2^30, which is no small integer                                        set
33       N           samples in a block; from here on in the order of set_up                set
34       MEAN_K      of the half-second means, Q15                                          set
35       STILL_GYRO  sum                                                                    set
36       STILL_ACCEL counts * samples, Q6                                                   set
37-38    LIMIT       sum: bias that is believed before and after the first rest             set
39-40    LIMIT_BIAS  the same, inc Q8                                                       set
41       REST        how long it must be still                                              set
42       RESTED_MAX  averaging time of the bias at rest                                     set
43       YOUNG       how long the mean alone levels                                         set
44       RAMP        gain * dt, Q24, times age                                              set
45       K_MOTION    gain * dt, Q24                                                         set
46       K_REST      the same                                                               set
47       HALF_G      counts                                                                 set
48       QUICK       5 s                                                                    set
49       KNOWN_MAX   time constant of the bias in motion                                    set
50       LEARN_AGE   from when on the bias is learned in motion                             set
51       LOST        samples in 2 s                                                         set
52       SPEED_K     Q15                                                                    set
53       FAST        speed to gain * dt, Q24: times FAST / 2^15 >> FAST_SHIFT               set
54       FAST_SHIFT  see FAST; the last coefficient                                         set
55       SEQ         steps so far, modulo 2^30; the first of the state                     step
56       W           quaternion, sensor to earth, Q30       step, slow, level, stand, turn
57       X           the same                               step, slow, level, stand, turn
58       Y           the same                               step, slow, level, stand, turn
59       Z           the same                               step, slow, level, stand, turn
60       TRIM        (|q|^2 - 1) / 2, Q18: what the next sample takes off  step, level, stand, turn
61-63    LAST        inc of the last sample without bias                 step, stand, turn
64-66    BIAS        inc Q8                                              slow, view, stand
67-69    FRACTION    of the bias, Q8: what waits                                           step
70       VX          velocity that should not be there, g * 2^24                     step, slow
71       VY          the same                                                        step, slow
72       PX          position that should not be there, g * 2^24                     step, slow
73       PY          the same                                                        step, slow
74       K           gain * dt is K / 2^(15 + K_SHIFT), K below 2^15                       slow
75       K_SHIFT     see K                                                          slow, level
76       K_HALF      2^(K_SHIFT - 1), to round                                             slow
77       LEFT        time until the block is full, nominal samples Q15        step, slow, level
78       COUNT       samples in this block so far                             step, slow, level
79       OVER        the gyro was over its range in this block                step, slow, level
80       DUE         the view of the bias follows at the next sample          step, slow, level
81       BEGIN       the next sample is a block: 1 new means, 2 and yaw 0  slow, level, stand
82-87    SUM         of the block: inc with the bias in it, calibrated counts        step, slow
88-89    ROLL        mdeg, then the pitch; the first of the results      step, stand, turn
90       YAW         mdeg                                                       step, turn
91-93    RATES       mdps                                                      step, stand
94-96    FORCE       calibrated accelerometer, counts                                      step
97       AT_REST     1 or 0                                                                slow
98-103   MEAN        sums of the last half second, the accelerometer's in Q6               slow
104-106  HOME        the bias as last seen at rest, sum                        slow, stand
107-109  HOME_BIAS   the same, inc Q8                                          slow, stand
110-112  UP          acceleration in the earth frame, counts * samples                     slow
113      UP_SAMPLES  how many are in it                                                    slow
114      AGE         since the start, or since the attitude was lost           slow, stand
115      STILL       for how long it has been still, at most REST                          slow
116      RESTED      for how long it has been at rest, at most RESTED_MAX      slow, stand
117      LEARNED     it has rested once                                        slow, stand
118      MOVED       it has moved since the start                       slow, level, stand
119      SPEED       sum of the axes' |rate| over some seconds, sum            slow, level
120      KNOWN       how long the bias has been watched                  slow, view, stand
121      GAIN        gain * dt, Q24                                                        slow
122-127  TILT        Q24: earth x in sensor axes, earth y in sensor axes, filtered   slow, view
128-133  VELOCITY    Q24, of the same filter                                         slow, view
134-139  POSITION    Q24, of the same filter                                         slow, view
"""

import micropython
from micropython import const

from attitude.fixed.attitude.coefficients import INC_PER_DPS, set_up
from attitude.fixed.attitude.level import begin, begin_again, without_yaw
from attitude.fixed.attitude.step import step
from attitude.fixed.attitude.turn import keep, turn
from attitude.fixed.base import Fixed
from attitude.fixed.gap import bridge

_STEP = const(25)
_SEQ = const(55)
_BIAS = const(64)
_ROLL = const(88)
_AT_REST = const(97)
_STATE = const(55)
_STATE_END = const(140)


class Attitude(Fixed):
    """Roll, pitch and relative yaw in millidegrees for free motion, from raw counts.

    rate_hz: any real rate, 80 to 1000; gyro_dps, accel_g: the ranges that the counts come in.
    Further settings by name, as for the float Attitude: tau_s, fast_dps, rest_tau_s, bias_tau_s,
    rest_bias_s, rest_s, rest_gyro_dps, rest_accel_g, bias_limit_dps, start_bias_dps, lag_s.
    The algorithm is described there. The angles are for now, turned on by lag_s.
    """

    knows_yaw = True
    _unit_per_deg = INC_PER_DPS
    _seq_at = _SEQ
    _out_at = _ROLL
    _state_at = _STATE
    _state_end = _STATE_END
    _least_hz = 40  # so that a block of samples is no longer than 25 ms

    def __init__(self, rate_hz=250, gyro_dps=500, accel_g=8, **settings):
        super().__init__(rate_hz, gyro_dps, accel_g, _STATE_END, _STATE + 1, settings)

    def _set_up(self, **settings):
        set_up(self.pending, self.rate_hz, self.gyro_dps, self.accel_g, **settings)

    step = step
    keep = keep
    turn = turn

    @micropython.native
    def zero_yaw(self):
        """The direction it looks in now is yaw 0."""
        without_yaw(self._s)
        self.out[2] = 0

    @micropython.native
    def update(self, counts, dt_us=0):
        """One sample, dt_us after the one before; 0: at the filter's own period, as step()."""
        if dt_us > 0:
            bridge(self, counts, dt_us)
        else:
            step(self, counts)

    @micropython.viper
    def swap(self):
        """Take over the prepared coefficients; angle, bias and all other state stay. 10 to 25 us,
        no allocation: fit for an interrupt.
        """
        s = ptr32(self._s)
        new = ptr32(self.pending)
        n = _STATE
        s[_STEP] = new[_STEP]
        if new[_STATE]:
            new[_STATE] = 0
            while n:
                n -= 1
                s[n] = new[n]

    @micropython.native
    def reset(self):
        """Forget everything; the next sample starts anew with yaw 0."""
        begin(self._s)

    @micropython.native
    def relevel(self):
        """After a gap: the next samples level anew; yaw, bias and what is known of it stay."""
        begin_again(self._s)

    @property
    def at_rest(self):
        """True when it has stood still for rest_s."""
        return self._s[_AT_REST] == 1

    @property
    def bias_dps(self):
        """Gyro bias as estimated on top of the calibration, deg/s (makes floats)."""
        scale = self.rate_hz / (INC_PER_DPS * 256.0)
        return tuple([b * scale for b in self._s[_BIAS : _BIAS + 3]])

    # ---- floats, for the foreground

    def quaternion(self):
        """(w, x, y, z), sensor to earth, for now: turned on by lag_s at the last rate."""
        from attitude.fixed.attitude.stand import quaternion

        return self.whole(lambda state: quaternion(self._s, state, self.rate_hz))

    def linear_accel_g(self):
        """Acceleration without gravity in the robot's frame, g, at the instant of the last
        sample.
        """
        from attitude.fixed.attitude.stand import linear_accel_g

        return self.whole(lambda state: linear_accel_g(state, self._accel_lsb))

    def standing(self):
        """Where it stands, see attitude.standing."""
        from attitude.fixed.attitude.stand import standing

        return self.whole(lambda state: standing(self._s, state, self.rate_hz))

    def place(self, q):
        """The same with another attitude."""
        from attitude.fixed.attitude.stand import place

        place(self._s, q, self.rate_hz)

    def begin_at(self, there):
        """Begin there, past the time of levelling."""
        from attitude.fixed.attitude.stand import begin_at

        begin(self._s)
        begin_at(self._s, there, self.rate_hz)
