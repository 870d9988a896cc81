# SPDX-License-Identifier: MIT
"""Calibration at the REPL, step by step; imported only when it is used (app.calibrating()).

c = app.calibrating()   # ends the loop
c.gyro()                # the robot lies still
c.pose()                # once for each face up, in any order; or any resting poses
c.solve()               # solve(faces=False) for poses that are no faces
c.level(); c.nose_up()  # how the sensor sits in the robot; level(2) where no place is level
c.save("2026-05-01")
"""

from calibration import mounting
from calibration.poses import Poses, with_slopes
from calibration.rest import gyro_bias, rest

from firmware.calibration import PATH, load_for, save_calibration

_SLOPE_SPAN_C = 10.0  # two calibrations so far apart tell how the bias goes with temperature
_DOUBTFUL_MG = 10.0  # half a degree from square is 9 mg


class Calibrating:
    """The steps; each returns a text that says what was found. NotStill and ValueError say why
    one was refused; it may be tried again.

    cal: the Calibration so far; it begins with the stored one. warnings: about that, texts.
    """

    def __init__(self, imu, path=PATH):
        self._imu = imu
        self._path = path
        self.cal, self.warnings = load_for(imu, path)
        self._stored = self.cal
        self._solved = False
        self._poses = Poses(imu)
        self._level = []

    def __repr__(self):
        return "gyro(), pose() for each face up, solve(), level(), nose_up(), save(); app.start()"

    def gyro(self, seconds=2.0):
        """The gyro's bias, from rest."""
        self.cal = gyro_bias(self._imu, self.cal, seconds)
        return "gyro bias %.3f %.3f %.3f deg/s at %.1f degC" % (
            self.cal.gyro_bias_dps + (self.cal.temp_c,)
        )

    def pose(self, seconds=1.0):
        """One resting pose for the accelerometer."""
        up = self._poses.add(seconds)
        missing = self._poses.missing()
        return "%s is up; %s" % (
            up,
            "not yet up: " + ", ".join(missing) if missing else "all faces have been up: solve()",
        )

    def solve(self, faces=True):
        """Offset, scale and cross-axis of the accelerometer from the poses."""
        mounted = self.cal.gyro_matrix
        self.cal = self._poses.solve(self.cal, faces).but(gyro_matrix=mounted)
        self._solved = True
        text = "residual %.2f mg; accelerometer offset %.1f %.1f %.1f mg" % (
            (self.cal.residual_mg,) + tuple([1000 * b for b in self.cal.accel_bias_g])
        )
        if self.doubtful:
            text += "; much is left: it moved, or a side was not square"
        return text

    @property
    def doubtful(self):
        """Whether solve() left more than poses that are still and square would."""
        return self._solved and self.cal.residual_mg > _DOUBTFUL_MG

    def level(self, headings=1, seconds=1.0):
        """The robot as level as can be; or call it `headings` times on any slope, the robot
        turned on by an equal part of a full turn each time."""
        if len(self._level) == headings:
            self._level = []
        self._level.append(self._up(seconds))
        if len(self._level) < headings:
            return "%d of %d headings" % (len(self._level), headings)
        if headings > 1:
            self._level = [mounting.level_of(self._level)] * headings
        return "level; now lift the nose by 10 to 80 degrees: nose_up()"

    def nose_up(self, seconds=1.0):
        """The robot's nose lifted by 10 to 80 degrees: finds the mounting after level()."""
        if not self._level:
            raise ValueError("level() first")
        rotation = mounting.from_tilt(self._level[-1], self._up(seconds))
        self.cal = self.cal.mounted(rotation)
        self._level = []
        return "forward is %s, up is %s, %.1f degrees from square" % mounting.nearest(rotation)

    def save(self, date=""):
        """Store it. After solve(), and with a stored one of the same part 10 degC away, the biases
        over temperature are known from then on."""
        new = self.cal.but(date=date, who_am_i=self._imu.who_am_i)
        # without solve() the accelerometer's bias is still that of the stored temperature
        made = merged(self._stored, new) if self._solved else new.at(self._stored.temp_c)
        save_calibration(made, self._path)
        self.cal = self._stored = made
        sloped = any(made.accel_slope_g_per_c)
        return "saved, with biases over temperature" if sloped else "saved"

    def _up(self, seconds):
        still = rest(self._imu, seconds)
        return self.cal.apply(still.accel_g, still.gyro_dps)[0]


def merged(old, new):
    """`new`, solved, with the slopes that `old` tells: the same part, 10 degC away; else `new`."""
    if (
        old.residual_mg is None
        or old.who_am_i != new.who_am_i
        or abs(old.temp_c - new.temp_c) < _SLOPE_SPAN_C
    ):
        return new
    return with_slopes(old, new)
