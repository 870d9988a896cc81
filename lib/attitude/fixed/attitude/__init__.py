# SPDX-License-Identifier: MIT
"""The integer twin of attitude.Attitude: one viper call from raw counts to millidegrees."""

# Its numbers stand in one array of 32-bit integers that the files of this folder share. A constant
# of viper code must be local to its file to be free, so what stands once is this list, and a test
# holds every const() of the folder against it. "inc" is a rate times the nominal dt / 4 in 2^-30
# rad, "sum" is inc times samples, Qn a number times 2^n; spans of time are counts of blocks.
# Written by: set (coefficients and base: set-up, calibration, period), the files by their names.
#
# place   name        format and meaning                                                 written by
# 0-11    ACCEL       Q14: accelerometer's 9 coefficients, 3 offsets (folding)                  set
# 12-23   GYRO        9 coefficients, 3 offsets, to inc times 2^GYRO_SHIFT                      set
# 24      GYRO_SHIFT  how far the gyro's sums are shifted down                                  set
# 25      STEP        the period by the nominal one, Q15                                        set
# 26      RATE        mdps are inc times RATE / 2^15 >> RATE_SHIFT                              set
# 27      RATE_SHIFT  see RATE                                                                  set
# 28      E_SHIFT     counts * 2^13 >> E_SHIFT is g * 2^24                                      set
# 29      LAG_PRE     lag_s * rate, an angle Q15, is (inc >> LAG_PRE) * LAG >> LAG_POST         set
# 30      LAG         see LAG_PRE                                                               set
# 31      LAG_POST    see LAG_PRE                                                               set
# 32      ONE         2^30, which is no small integer                                           set
# 33      N           samples in a block; from here on in the order of set_up                   set
# 34      MEAN_K      of the half-second means, Q15                                             set
# 35      STILL_GYRO  sum                                                                       set
# 36      STILL_ACCEL counts * samples, Q6                                                      set
# 37      SHAKEN      the same of one sample                                                    set
# 38      TILTED      the same of the means                                                     set
# 39      NEAR        sum: the mean rate so near a bias is one                                  set
# 40      DRIFT       sum Q8: so much further for each block since the last rest                set
# 41      LIMIT       sum: at most, after the first rest                                        set
# 42      START_LIMIT sum: and before                                                           set
# 43      STEADY_MAX  for how long a rate must be steady to be a bias up to LIMIT               set
# 44      REST        how long it must be still                                                 set
# 45      RESTED_MAX  averaging time of the bias at rest                                        set
# 46      KEEP        how old the bias is that a rest leaves                                    set
# 47      YOUNG       how long the mean alone levels                                            set
# 48      OLD         the age that a rest gives, and the largest                                set
# 49      RAMP        gain * dt, Q24, times age                                                 set
# 50      K_MOTION    gain * dt, Q24                                                            set
# 51      K_REST      the same                                                                  set
# 52      HALF_G      counts                                                                    set
# 53      LOST        samples in 2 s                                                            set
# 54      MG          counts * samples to g Q12: times MG / 2^15 >> MG_SHIFT                    set
# 55      MG_SHIFT    see MG                                                                    set
# 56      RATE_K      of the mean squares of the rates and of LEVEL, Q15                        set
# 57      PER_SPAN2   1 / span^2, 1 / s^2: makes squares of rates of those of turns             set
# 58      SUM_RAD     rad/s to sum, 2^-9 of it                                                  set
# 59      INC_RAD     rad/s to inc Q8                                                           set
# 60      SPAN        s, Q15                                                                    set
# 61      FASTER      Q12, times the gyro's error: how much faster the loop shall be            set
# 62      MOST        rad/s, Q24: the correction's limit is this and MOST_SIGMAS (Q8)           set
# 63      MOST_SIGMAS see MOST                                                                  set
# 64      TOP         square of a speed that no body has, (g blocks)^2 Q12                      set
# 65      TOP_K       of its leak, Q15                                                          set
# 66      WALK        (rad/s)^2 between two looks, Q44                                          set
# 67      WALKS       rad/s, Q32: a bias is further from the last rest's for each block         set
# 68      SHAKE_K     of SHAKE, Q15                                                             set
# 69      KEEPS       of the yaw's view of a bias, Q15                                          set
# 70      LOOK        between two looks                                                         set
# 71      VIEW_N      errors that the view follows in a tick                                    set
# 72      START       sigma of a bias before the first rest, rad/s Q30                          set
# 73      SCALE       sigma of a scale, Q30                                                     set
# 74      CROSS       the same of the matrix' other elements; the last coefficient              set
# 75      SEQ         steps so far, modulo 2^30; the first of the state                        step
# 76      W           quaternion, sensor to earth, Q30        step, slow, level, learn, stand, turn
# 77      X           the same                                step, slow, level, learn, stand, turn
# 78      Y           the same                                step, slow, level, learn, stand, turn
# 79      Z           the same                                step, slow, level, learn, stand, turn
# 80      BEGIN       the next sample is a block: 1 new means, 2 and yaw 0       slow, level, stand
# 81-83   BIAS        inc Q8                                                     slow, learn, stand
# 84-95   USED        GYRO as learned                                                        errors
# 96-98   BEFORE      the bias of the last rest, KEEP to twice that before its end      slow, stand
# 99-101  NEXT        the bias that will be there next                                  slow, stand
# 102     SINCE       since the last rest                                               slow, stand
# 103     LEARNED     1 it has rested once, 2 and that was no slow tilt                 slow, stand
# 104     MOVED       it has moved since the start                               slow, level, stand
# 105-118 SIGMA       how well each error is known, Q30; see learn       errors, learn, pace, stand
# 119-121 RELATED     correlations of scales, Q15: y with z, z with x, x with y       learn, errors
# 122-125 SPREAD      (rad/s)^2 Q28 of biases, of the matrix by rate x, y, z                 errors
# 126     TILT        sigma of the unknown tilt, rad Q15                               errors, pace
# 127-135 MATRIX      what was learned less identity, Q30                             learn, errors
# 136     NOISE       g^2 Q30: variance of what no error explains                     learn, errors
# 137     LOOKS       so far, at most 2^15 - 1                                        learn, errors
# 138     YAW_NOISE   rad^2 Q26: variance of the yaw that no view shows         learn, level, pace
# 139     YAW_BLOCKS  since the yaw counts                                             level, slow
# 140-141 HELD        rad Q25: of the yaw, taken off at rest in the last 1 to 2 s      level, slow
# 142-154 YAW_VIEW    VIEW of the yaw                                           learn, level, slow
# 155-156 ROLL        mdeg, then the pitch; the first of the results              step, stand, turn
# 157     YAW         mdeg; what follows is forgotten after a gap                        step, turn
# 158-160 RATES       mdps                                                              step, stand
# 161-163 FORCE       calibrated accelerometer, counts                                         step
# 164     AT_REST     1 or 0                                                                   slow
# 165     UNCERTAIN   0, 1 not known, 2 pushed                                          pace, level
# 166     TRIM        (|q|^2 - 1) / 2, Q18: the next sample takes it off   step, level, stand, turn
# 167-169 LAST        inc of the last sample, as learned                          step, stand, turn
# 170-172 FRACTION    of the bias, Q8: what waits                                              step
# 173     VX          velocity that should not be there, g * 2^24                 step, pace, learn
# 174     VY          the same                                                    step, pace, learn
# 175     PX          position that should not be there, g * 2^24                 step, pace, learn
# 176     PY          the same                                                    step, pace, learn
# 177     K           gain * dt is K / 2^(15 + K_SHIFT), K below 2^15                          pace
# 178     K_SHIFT     see K                                                             pace, level
# 179     K_HALF      2^(K_SHIFT - 1), to round                                                pace
# 180     MOST_G      of a position that corrects, g * 2^24                             pace, level
# 181     LEFT        time until the block is full, nominal samples Q15           step, slow, level
# 182     COUNT       samples in this block so far                          step, slow, level, turn
# 183     OVER        the gyro was over its range in this block                   step, pace, level
# 184     STUCK       the accelerometer was over its range in this block          step, pace, level
# 185-190 SUM         of the block: inc with the bias in it, calibrated counts     step, slow, turn
# 191-196 MEAN        sums of the last half second, the accelerometer's in Q6                  slow
# 197-199 FIRST       the accelerometer's when it became still                                 slow
# 200     KEPT        since it changed                                                         slow
# 201-203 UP          acceleration in the earth frame, counts * samples                        slow
# 204     UP_SAMPLES  how many are in it                                                       slow
# 205-207 NOW         the same of this block, g Q12                                            slow
# 208     AGE         since the start, or since the attitude was lost             slow, pace, stand
# 209     STILL       for how long it has been still, at most REST                             slow
# 210     STEADY      for how long it would be, whatever the bias, at most STEADY_MAX          slow
# 211     RESTED      for how long it has been at rest, at most RESTED_MAX                     slow
# 212     GAIN        gain * dt, Q24                                                    pace, stand
# 213-215 SQUARES     mean squares of the rates, (rad/s)^2 Q12                                 pace
# 216     LEVEL       level acceleration of late, g Q20                                        pace
# 217     SEEN        for how long it has been seen, at most 3 s                         slow, pace
# 218-219 PUSHED      speed that passed for acceleration, g blocks Q8                          pace
# 220     SHAKE       mean square of the position, g^2 Q30                                     pace
# 221     EVENT       what has happened: bits, see pace                     slow, pace, stand, turn
# 222     WORK        what a tick has to do: 30, 31 pace, 1-25 learn              slow, pace, learn
# 223     WAIT        until the next look                                                      pace
# 224     AXIS        to look at                                                               pace
# 225     FLAGS       1, 2 the axis is limited, 4 velocity forgotten, 8 not followed, 16 look  pace
# 226     G           gain * span, Q15                                                         pace
# 227-229 TURN        of the block about the sensor's axes, rad Q15                            slow
# 230-238 ROWS        rotation matrix at the end of the block, Q15                             slow
# 239-244 LAST_ROWS   its first two rows at the end of the one before                          pace
# 245-250 MID         mean over the block of row y, of row -x, Q14                             pace
# 251-328 VIEW        Q20: tilt, velocity, position by 13 errors; of level x, of y      learn, pace
# 329-330 EXPLAINED   g^2 Q30: variance of the positions by the errors                  learn, pace
# 331-343 SHARE       of a position by the sigma of each error, Q(20 - SCALED); changes, Q28  learn
# 344-356 TOLD        what is seen of each error, by its sigma, Q15                           learn
# 357     SCALED      see SHARE                                                               learn
# 358     QUIET       variance of the position without errors, in SHARE's scale               learn
# 359     NU          the position by its sigma, Q13                                          learn
# 360-362 CHANGE      tilt x, tilt y, yaw to turn on by, rad Q24                      learn, level
# 363     HIDDEN      tilt that a gap may hide, rad Q15                                        turn

from math import degrees

import micropython
from micropython import const

from attitude.counts import known
from attitude.fixed.attitude.coefficients import INC_PER_DPS, know, set_up
from attitude.fixed.attitude.errors import know_nothing, spread, use
from attitude.fixed.attitude.level import begin, begin_again, zero_yaw
from attitude.fixed.attitude.step import step
from attitude.fixed.attitude.turn import keep, turn
from attitude.fixed.base import Fixed
from attitude.fixed.gap import bridge

_STEP = const(25)
_N = const(33)
_SEQ = const(75)
_BIAS = const(81)
_BEGIN = const(80)
_SIGMA = const(105)
_LOOKS = const(137)
_ROLL = const(155)
_AT_REST = const(164)
_UNCERTAIN = const(165)
_STATE = const(75)
_STATE_END = const(364)


class Attitude(Fixed):
    """Roll, pitch and relative yaw in millidegrees for free motion, from raw counts.

    rate_hz: any real rate, 80 to 1000; gyro_dps, accel_g: the ranges that the counts come in.
    Further settings by name, as for the float Attitude, its Rest and GyroLearning: see set_up in
    coefficients; what a calibration tells of them (attitude.counts.known) counts where they are
    not set. The algorithm is described there. The angles are for now, turned on by lag_s.
    """

    knows_yaw = True
    _unit_per_deg = INC_PER_DPS
    _spare = 1.2
    _seq_at = _SEQ
    _out_at = _ROLL
    _state_at = _STATE
    _state_end = _STATE_END
    _least_hz = 40  # so that one sample is no longer than 25 ms

    def __init__(self, rate_hz=250, gyro_dps=500, accel_g=8, **settings):
        super().__init__(rate_hz, gyro_dps, accel_g, _STATE_END, _STATE + 1, settings)

    _known: dict = {}  # by the calibration
    _matrix = ()  # that what was learned belongs to

    def _set_up(self, **settings):
        settings.update([pair for pair in self._known.items() if pair[0] not in settings])
        set_up(self.pending, self.rate_hz, self.gyro_dps, self.accel_g, **settings)

    def _fold(self, cal):
        super()._fold(cal)
        if cal.gyro_matrix != self._matrix:
            self._matrix = cal.gyro_matrix
            self.pending[_STATE] |= 2
        now = known(cal)
        if now != self._known:
            self._known = now
            settings = now.copy()
            settings.update(self._settings)
            know(self.pending, **settings)

    step = step
    keep = keep
    turn = turn

    @micropython.native
    def zero_yaw(self):
        """The direction it looks in now is yaw 0."""
        zero_yaw(self._s)
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
        """Take over the prepared coefficients; angle, bias and all other state stay, what was
        learned of the gyro's scale unless the calibration has another. No allocation, 10 us for a
        period, 150 us else: fit for an interrupt.
        """
        s = ptr32(self._s)
        new = ptr32(self.pending)
        n = _STATE
        s[_STEP] = new[_STEP]
        fresh = new[_STATE]
        if fresh:
            new[_STATE] = 0
            while n:
                n -= 1
                s[n] = new[n]
            if fresh & 2 or s[_BEGIN] > 1:
                know_nothing(self._s)
            n = 0
            while n < 3:
                use(self._s, n)
                n += 1

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

    @property
    def bias_sigma_dps(self):
        """One sigma of each of them, deg/s."""
        return tuple([degrees(sigma / 1073741824.0) for sigma in self._s[_SIGMA : _SIGMA + 3]])

    @property
    def uncertain(self):
        """Not 0 while the tilt is not known well enough to be claimed: 1 it levels, or its
        gyro is not known; 2 pushes have moved what it levels by."""
        return self._s[_UNCERTAIN]

    def set_state(self, state):
        """Continue from a state() of a filter with the same settings."""
        super().set_state(state)
        self._use()

    def take_state(self, other):
        """The same from another one with the same settings, without room for a state()."""
        super().take_state(other)
        self._use()

    def _use(self):
        for row in range(3):
            use(self._s, row)

    def go_on_from(self, other, dt_us=0, yaw_deg=None):
        """See Fixed; what another one has learned of the same gyro's scale stays known."""
        super().go_on_from(other, dt_us, yaw_deg)
        if isinstance(other, Attitude) and not self.alike(other):
            self.learn_from(other)

    def learn_from(self, other):
        """Another one's scale and cross-axis are known here too. Not while this one runs."""
        if other._matrix == self._matrix:
            for at in range(_SIGMA + 3, _LOOKS + 1):
                self._s[at] = other._s[at]
            spread(self._s)
            self._use()

    # ---- floats, for the foreground

    def learned(self):
        """(scale, its sigma, bias_dps, its sigma), three numbers each: what each axis reads too
        much, as a part of the rate and in deg/s, on top of the calibration."""
        from attitude.fixed.attitude.claims import learned

        return self.whole(lambda state: learned(state, self.bias_dps, self.bias_sigma_dps))

    def calibration_learned(self):
        """The nine elements that a true rate is made of by one calibrated before, row by row."""
        from attitude.fixed.attitude.claims import matrix

        return self.whole(matrix)

    @property
    def tilt_sigma_deg(self):
        """One sigma of each level axis, degrees; see attitude.bounds."""
        from attitude.fixed.attitude.claims import tilt_sigma_deg

        return self.whole(tilt_sigma_deg)

    @property
    def yaw_sigma_deg(self):
        """One sigma of the rotation about the vertical since the start or zero_yaw(), degrees."""
        from attitude.fixed.attitude.claims import yaw_sigma_deg

        block_s = self._s[_N] / self.rate_hz
        return self.whole(lambda state: yaw_sigma_deg(state, block_s))

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
