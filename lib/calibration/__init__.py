# SPDX-License-Identifier: MIT
"""What one sensor on one robot needs so that its readings are true: numbers only, no bus.

true = matrix (reading - bias), matrices 3 x 3 as row-major tuples of 9. The mounting rotation is
multiplied into both, so readings come out in the robot's frame: x forward, y left, z up.
The procedures that find the numbers are in rest.py, poses.py and mounting.py; fields.py knows what
they may be.
"""

VERSION = 1
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
ZERO = (0.0, 0.0, 0.0)

class Calibration:
    """Biases (deg/s, g) at temp_c (degC), their slopes per degC, matrices; and where from.

    residual_mg: what was left of the fit, None without one. who_am_i: the part's id or None.
    date: any text. Immutable in spirit: every method returns a new one.
    """

    def __init__(self, gyro_bias_dps=ZERO, accel_bias_g=ZERO, gyro_matrix=IDENTITY,
                 accel_matrix=IDENTITY, temp_c=25.0, gyro_slope_dps_per_c=ZERO,
                 accel_slope_g_per_c=ZERO, residual_mg=None, who_am_i=None,
                 date=""):  # fmt: skip
        self.gyro_bias_dps = tuple(gyro_bias_dps)
        self.accel_bias_g = tuple(accel_bias_g)
        self.gyro_matrix = tuple(gyro_matrix)
        self.accel_matrix = tuple(accel_matrix)
        self.temp_c = temp_c
        self.gyro_slope_dps_per_c = tuple(gyro_slope_dps_per_c)
        self.accel_slope_g_per_c = tuple(accel_slope_g_per_c)
        self.residual_mg = residual_mg
        self.who_am_i = who_am_i
        self.date = date

    def apply(self, accel_g, gyro_dps):
        """((ax, ay, az) in g, (gx, gy, gz) in deg/s) of the robot from the sensor's readings."""
        return (
            _correct(self.accel_matrix, self.accel_bias_g, accel_g),
            _correct(self.gyro_matrix, self.gyro_bias_dps, gyro_dps),
        )

    def but(self, **changes):
        """The same with some fields changed, by name."""
        fields = self.__dict__.copy()
        for name in changes:
            if name not in fields:
                raise ValueError("a Calibration has no %s" % name)
        fields.update(changes)
        return Calibration(**fields)

    def at(self, temp_c):
        """The same for a chip at temp_c: biases moved along their slopes."""
        warm = temp_c - self.temp_c
        return self.but(
            temp_c=temp_c,
            gyro_bias_dps=_along(self.gyro_bias_dps, self.gyro_slope_dps_per_c, warm),
            accel_bias_g=_along(self.accel_bias_g, self.accel_slope_g_per_c, warm),
        )

    def gyro_from(self, other):
        """The same with the gyro's bias and slope of `other`, brought to this one's temp_c."""
        return self.but(
            gyro_bias_dps=other.at(self.temp_c).gyro_bias_dps,
            gyro_slope_dps_per_c=other.gyro_slope_dps_per_c,
        )

    def mounting(self):
        """All that another part can use of it: how the sensor sits in the robot."""
        turned = self.rotation()
        return Calibration(gyro_matrix=turned, accel_matrix=turned)

    def rotation(self):
        """The mounting alone: the rotation nearest to gyro_matrix, which may have scales in it."""
        m = self.gyro_matrix
        for _ in range(5):  # 3/2 m - 1/2 m m' m, until its columns are of length 1
            square = multiply(m, [m[i] for i in (0, 3, 6, 1, 4, 7, 2, 5, 8)])
            if max([abs(s - i) for s, i in zip(square, IDENTITY)]) < 1e-5:
                break
            m = tuple([1.5 * a - 0.5 * b for a, b in zip(m, multiply(square, m))])
        return m

    def mounted(self, rotation):
        """The same, its output turned by this row-major rotation matrix (mounting.py)."""
        return self.but(
            gyro_matrix=multiply(rotation, self.gyro_matrix),
            accel_matrix=multiply(rotation, self.accel_matrix),
        )

    def to_dict(self):
        """Plain lists, numbers and text for JSON."""
        fields = {}
        for name, value in self.__dict__.items():
            fields[name] = list(value) if isinstance(value, tuple) else value
        fields["version"] = VERSION
        return fields

    @classmethod
    def from_dict(cls, fields):
        """The Calibration of such a dict; what is missing keeps its default.

        ValueError that names the field and what is wrong with it: these numbers come from a file.
        """
        from calibration.fields import checked

        return cls(**checked(fields))


def multiply(a, b):
    """Product of two row-major 3 x 3 matrices."""
    return tuple(
        [sum([a[3 * i + k] * b[3 * k + j] for k in range(3)]) for i in range(3) for j in range(3)]
    )


def _correct(m, bias, v):
    x, y, z = v[0] - bias[0], v[1] - bias[1], v[2] - bias[2]
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[3] * x + m[4] * y + m[5] * z,
        m[6] * x + m[7] * y + m[8] * z,
    )


def _along(bias, slope, warm):
    return tuple([b + s * warm for b, s in zip(bias, slope)])
