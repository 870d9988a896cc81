# SPDX-License-Identifier: MIT
"""KalmanTilt for roll and pitch in one viper call, from raw counts, without allocation."""

import micropython
from micropython import const

from attitude.fixed.base import Fixed
from attitude.fixed.gains import gain_rows, place_in
from attitude.fixed.gap import bridge
from attitude.fixed.kalman_step import keep, step, turn

# places and formats: kalman_step
_STEP = const(25)
_K0_SHIFT = const(28)
_K1_SHIFT = const(29)
_BIAS_LIMIT = const(30)
_DISTRUST = const(31)  # Q15 weight lost for every 1/256 count that |a| is off 1 g
_ONE_G = const(32)
_STATE = const(33)  # from here on what samples change
_SEQ = const(33)
_STARTED = const(34)
_ROLL = const(35)
_ROLL_BIAS = const(36)
_PITCH = const(37)
_PITCH_BIAS = const(38)
_YAW_BIAS = const(39)  # as taken over from another filter: not learned here
_OUT = const(42)
_RATES = const(45)
_LEFT = const(52)  # the place in the gain table: samples left in this row
_ROW = const(53)
_TABLE = const(58)
_SIZE = const(178)  # 33 knots at most are 2 + 3 * 33 numbers; some to spare
# in `pending` after the coefficients, the place and the table: 1 all coefficients are new, and
# times 2 how many numbers of place and table are
_FRESH = const(159)
_UNIT_PER_DEG = 2048000.0


class KalmanTilt2(Fixed):
    """Roll and pitch in millidegrees; the integer twin of two KalmanTilt on one sensor.

    rate_hz: any real rate; gyro_dps, accel_g: the ranges that the counts come in.
    q_angle (deg^2/s), q_bias ((deg/s)^2/s), r_measure (deg^2): paper 000, eqs. 16-27. The
    covariance does not depend on the data, so the gains are made at construction.
    trust_g: the accelerometer's weight falls linearly from 1 at |a| = 1 g to 0 at 1 g +-
    trust_g, a measurement noise that adapts to pushes and knocks; None: always 1. Against motors
    it makes things worse: put a LowPass or AdaptiveNotch ahead (figures: tools/vibration.py).
    It starts on the first sample's accelerometer angle. Motion about one axis at a time.
    """

    _unit_per_deg = _UNIT_PER_DEG
    _seq_at = _SEQ
    _out_at = _OUT
    _state_at = _STATE
    _state_end = _TABLE

    def __init__(
        self,
        rate_hz=250,
        gyro_dps=500,
        accel_g=8,
        q_angle=0.001,
        q_bias=0.003,
        r_measure=0.03,
        trust_g=None,
    ):
        settings = {
            "q_angle": q_angle,
            "q_bias": q_bias,
            "r_measure": r_measure,
            "trust_g": trust_g,
        }
        super().__init__(rate_hz, gyro_dps, accel_g, _SIZE, _FRESH + 1, settings)

    def _set_up(self, q_angle, q_bias, r_measure, trust_g):
        if not (q_angle >= 0.0 and q_bias >= 0.0 and r_measure > 0.0):
            raise ValueError("q_angle, q_bias: not below 0; r_measure: above 0")
        if trust_g is not None and not trust_g > 0.0:
            raise ValueError("trust_g: above 0, or None")
        new = self.pending
        rows, new[_K0_SHIFT], new[_K1_SHIFT] = gain_rows(self.rate_hz, q_angle, q_bias, r_measure)
        new[_BIAS_LIMIT] = 1073000000  # 8186 millidegrees a sample: the number range, no judgement
        new[_ONE_G] = self._accel_lsb
        new[_DISTRUST] = 0
        if trust_g is not None:
            new[_DISTRUST] = max(1, int(32768.0 * 256.0 / (trust_g * self._accel_lsb)))
        # last, since the filter may be running meanwhile: its place for the time it has run
        place = place_in(rows, self._s[_SEQ])
        place[1] += _TABLE
        for i, value in enumerate(place + rows):
            new[_STATE + i] = value
        new[_FRESH] = len(place + rows) << 1 | 1

    _home = None  # the bias at rest that was handed over

    step = step
    keep = keep
    turn = turn

    @micropython.native
    def update(self, counts, dt_us=0):
        """One sample, dt_us after the one before; 0: at the filter's own period, as step()."""
        if dt_us > 0:
            bridge(self, counts, dt_us)
        else:
            step(self, counts)

    @micropython.viper
    def swap(self):
        """Take over the prepared coefficients; angle, bias and all other state stay. 10 to 45 us,
        no allocation: fit for an interrupt.

        The place in the gain table is no state: it is that for the time the filter has run.
        """
        s = ptr32(self._s)
        new = ptr32(self.pending)
        n = _STATE
        s[_STEP] = new[_STEP]
        fresh = new[_FRESH]
        if fresh:
            new[_FRESH] = 0
            while n:
                n -= 1
                s[n] = new[n]
        n = fresh >> 1
        while n:
            n -= 1
            s[_LEFT + n] = new[_STATE + n]

    def reset(self):
        """Start anew on the next sample, with bias 0."""
        self._home = None
        for i in range(_STATE, _TABLE):
            self._s[i] = 0
        self._run_for(0)

    def _run_for(self, samples):
        s = self._s
        s[_SEQ] = samples
        for i, value in enumerate(place_in(s[_TABLE:], samples)):
            s[_LEFT + i] = value
        s[_ROW] += _TABLE

    @micropython.viper
    def relevel(self):
        """Start at the accelerometer's angles of the next sample; the bias stays."""
        s = ptr32(self._s)
        s[_STARTED] = 0

    def zero_yaw(self):
        """Nothing: its yaw is always 0."""

    @property
    def bias_dps(self):
        """Gyro bias as estimated on top of the calibration, deg/s (makes floats); that about z
        is what go_on_from() has brought."""
        return self._biases(self.state())

    def _biases(self, state):
        scale = self.rate_hz / (64.0 * _UNIT_PER_DEG)
        return tuple(
            [state[at - _STATE] * scale for at in (_ROLL_BIAS, _PITCH_BIAS, _YAW_BIAS)]
        )

    # ---- for attitude.standing

    def take_state(self, other):
        """See Fixed."""
        super().take_state(other)
        self._home = other._home

    def standing(self):
        """Where it stands: yaw 0, and of its bias at rest it knows what was handed over."""
        from attitude.standing import of_angles

        state = self.state()
        if not state[_SEQ - _STATE]:
            return None
        angles = [state[at - _STATE] / _UNIT_PER_DEG for at in (_ROLL, _PITCH)]
        rates = [rate / 1000.0 for rate in state[_RATES - _STATE : _RATES - _STATE + 3]]
        return of_angles(angles[0], angles[1], 0.0), rates, self._biases(state), self._home

    def alike(self, other):
        """Whether the other's state() is understood here."""
        return super().alike(other) and other._settings == self._settings

    def place(self, q):
        """The same with another attitude, but for its yaw."""
        from attitude.standing import angles_deg

        s = self._s
        for i, at in enumerate((_ROLL, _PITCH)):
            angle = angles_deg(q)[i]
            s[at] = round(angle * _UNIT_PER_DEG)
            s[_OUT + i] = round(angle * 1000.0)

    def begin_at(self, standing):
        """Begin there, with the gains of one that has run for long."""
        q, rates, bias, home = standing
        self.reset()
        self._home = home
        s = self._s
        scale = 64.0 * _UNIT_PER_DEG / self.rate_hz
        for i, at in enumerate((_ROLL_BIAS, _PITCH_BIAS, _YAW_BIAS)):
            limit = s[_BIAS_LIMIT]
            s[at] = round(max(-limit, min(limit, bias[i] * scale)))
            s[_RATES + i] = round(1000.0 * rates[i])
        s[_STARTED] = 1
        self._run_for(int(60 * self.rate_hz))
        self.place(q)
