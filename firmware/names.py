# SPDX-License-Identifier: MIT
"""Names that code brings which is loaded for a moment (python -m tools.names writes this): heard
before it, they lie together and are no islands in the heap when it has gone. MicroPython keeps
names in pools of 20, 40, ... 640; the next, from the 1261st on, takes 9 KB in one piece.
"""


def hear():
    """MicroPython keeps all names of this module from now on."""
    for name in (
        "/lib/attitude/bounds.mpy", "/lib/attitude/complementary.mpy",
        "/lib/attitude/fixed/attitude/claims.mpy", "/lib/attitude/fixed/gains.mpy",
        "/lib/attitude/fixed/kalman_step.mpy", "/lib/attitude/fixed/kalman_tilt2.mpy",
        "/lib/attitude/float_base.mpy", "/lib/attitude/float_tilt.mpy",
        "/lib/attitude/kalman_tilt.mpy", "/lib/calibration/fields.mpy",
        "/lib/calibration/mounting.mpy", "/lib/calibration/poses.mpy",
        "/lib/calibration/rest.mpy", "/lib/calibration/solve.mpy", "/lib/mpu6050/selftest.mpy",
        "attitude.bounds", "attitude.complementary", "attitude.fixed.attitude",
        "attitude.fixed.gains", "attitude.fixed.kalman_step", "attitude.fixed.kalman_tilt2",
        "attitude.float_base", "attitude.float_tilt", "attitude.kalman_tilt",
        "calibration.mounting", "calibration.poses", "calibration.rest", "calibration.solve",
        "firmware.diagnose", "firmware.faults.policy", "firmware.settings", "firmware.startup",
        "firmware.store", "firmware.texts", "firmware/beginning.mpy", "firmware/calibrating.mpy",
        "firmware/calibration.mpy", "firmware/first.mpy", "firmware/levelling.mpy",
        "firmware/loading.mpy", "firmware/report.mpy", "firmware/startup.mpy",
        "firmware/stats.mpy", "firmware/store.mpy", "firmware/texts.mpy", "mpu6050.selftest",
    ):
        getattr(None, name, None)


def _of_this_module(x):  # by being in its code, which nobody calls
    x(
        " %.3g %s", " = ", " or ", "%+.1f %%", "%r: %r", "%s %s %s", "%s%s: %s", "%s: %s", "+",
        "+-", "+x", "+z", ", ", "-", ".new", ".old", "deg/s", "moved: ", "one of ", "too long",
        "{%s}", "~", x.Axis, x.BAD, x.Begin, x.Bounds, x.Complementary, x.FloatTilt, x.FromCounts,
        x.KalmanTilt, x.KalmanTilt2, x.Knob, x.NotStill, x.PARTS, x.Poses, x.Stats, x.YAW_NOISE,
        x._BAD, x._CLAIMED_DEG, x._CLASS, x._DOUBTED_DEG, x._DOUBTFUL_MG, x._EDITED, x._FACES,
        x._FIELDS, x._FLOAT, x._FORGOTTEN, x._FRESH, x._GENERATION_MAX, x._GROUPS, x._HELP,
        x._INTEGER, x._KB, x._KNOWN_SCALE, x._LEAST_DEG, x._LINES_MAX, x._LINE_MAX, x._LONGEST_US,
        x._MEANINGS, x._NAMES, x._NONE, x._OVER, x._PERFECT, x._PRIOR, x._Part, x._Q15, x._Q20,
        x._Q26, x._RATIO, x._SETTLED, x._SHAKEN, x._SHAKEN_S, x._SIZE_MAX, x._SLOPE_SPAN_C,
        x._TILT, x._UNIT_PER_DEG, x._WAYS, x._WORTH_DPS, x._WORTH_SCALE, x._YAW, x._axis,
        x._biases, x._brought, x._crc_line, x._determinant, x._dot, x._eliminate, x._explained,
        x._folding, x._free, x._home, x._inverse, x._knob, x._knots, x._levelled, x._linearise,
        x._lines, x._mean, x._needed, x._nominal16, x._not_still, x._number, x._numbers, x._of,
        x._over, x._parse, x._path, x._period16, x._poses, x._rests, x._run_for, x._same_again,
        x._sample, x._scalar, x._scaling, x._set_angles, x._sigma, x._solved, x._square,
        x._squares, x._started, x._stored, x._symmetric, x._tell, x._temps, x._text, x._tidied,
        x._times, x._trims, x._trims_6500, x._true, x._twice, x._unit, x._up, x._update, x._value,
        x._variance, x._with, x._written, x._yaw, x.accel_angle_deg, x.acos, x.age_ms, x.alpha,
        x.axes, x.axis, x.balance_kd, x.balance_kp, x.base, x.beginning, x.bias_forgotten,
        x.binascii, x.block_s, x.bounds, x.centre, x.choices, x.claims, x.cold, x.complementary,
        x.core, x.cores, x.crc, x.crc32, x.decode, x.default, x.diagnose, x.doubtful, x.drift,
        x.e, x.encode, x.explained, x.face, x.faces, x.faults, x.float_base, x.float_tilt,
        x.folding, x.force_g, x.forget_yaw, x.forward, x.from_faces, x.from_rest, x.from_tilt,
        x.g, x.gain_rows, x.gains, x.generation, x.go_on_with, x.gyro_bias, x.gyro_scale, x.head,
        x.headings, x.intmath, x.isfinite, x.kalman_step, x.kalman_tilt, x.kalman_tilt2, x.knots,
        x.level_of, x.limit, x.load_calibration, x.load_for, x.loaded, x.loading, x.mean,
        x.meaning, x.merged, x.missing, x.motion, x.nearest, x.nose_up, x.off, x.orientation,
        x.over_range, x.p00, x.p01, x.p11, x.part, x.partition, x.pin_out_1, x.pin_out_2,
        x.pin_out_3, x.pin_out_4, x.pin_scl, x.pin_sda, x.place_in, x.plumb, x.pose, x.poses,
        x.predicted, x.px, x.py, x.rate_dps, x.rb, x.readings, x.refine, x.rename, x.response,
        x.save_calibration, x.saved, x.scale1, x.selftest, x.sigma, x.solve, x.span_s, x.square,
        x.stat, x.stored, x.target, x.text, x.tilt, x.tilt_deg, x.trim, x.trust_g, x.used,
        x.variance, x.view, x.wb, x.with_slopes, x.word, x.xyz, x.yaw, x.young,
    )
