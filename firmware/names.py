# SPDX-License-Identifier: MIT
"""Names that code brings which is loaded for a moment (python -m tools.names writes this): heard
before it, they lie together and are no islands in the heap when it has gone.
"""


def _(o):
    return (
        o.Axis, o.BAD, o.Begin, o.Bounds, o.Complementary, o.FromCounts, o.KalmanTilt2, o.Knob,
        o.NotStill, o.PARTS, o.Poses, o.Stats, o.YAW_NOISE, o._CLAIMED_DEG, o._CLASS,
        o._DOUBTED_DEG, o._DOUBTFUL_MG, o._EDITED, o._FACES, o._FIELDS, o._FLOAT, o._FORGOTTEN,
        o._FRESH, o._GENERATION_MAX, o._GROUPS, o._HELP, o._INTEGER, o._KB, o._KNOWN_SCALE,
        o._LEAST_DEG, o._LINES_MAX, o._LINE_MAX, o._LONGEST_US, o._MEANINGS, o._NAMES, o._NO_ROOM,
        o._OVER, o._PERFECT, o._PRIOR, o._Part, o._Q15, o._Q20, o._Q26, o._RATIO, o._SETTLED,
        o._SHAKEN, o._SHAKEN_S, o._SIZE_MAX, o._SLOPE_SPAN_C, o._TILT, o._UNIT_PER_DEG, o._WAYS,
        o._WORTH_DPS, o._WORTH_SCALE, o._YAW, o._axis, o._biases, o._brought, o._crc_line,
        o._determinant, o._dot, o._eliminate, o._explained, o._folding, o._free, o._generation,
        o._knob, o._knots, o._levelled, o._linearise, o._lines, o._mean, o._needed, o._nominal16,
        o._not_still, o._number, o._numbers, o._of, o._over, o._parse, o._path, o._period16,
        o._poses, o._rests, o._run_for, o._same_again, o._sample, o._scalar, o._scaling,
        o._set_angles, o._sigma, o._solved, o._square, o._squares, o._started, o._stored,
        o._symmetric, o._tell, o._temps, o._text, o._tidied, o._trims, o._trims_6500, o._true,
        o._unit, o._up, o._update, o._value, o._variance, o._with, o._yaw, o.accel_angle_deg,
        o.acos, o.age_ms, o.alpha, o.axes, o.axis, o.balance_kd, o.balance_kp, o.bias_forgotten,
        o.binascii, o.block_s, o.centre, o.choices, o.cold, o.core, o.cores, o.crc, o.crc32,
        o.decode, o.default, o.diagnose, o.doubtful, o.drift, o.e, o.encode, o.explained, o.face,
        o.faces, o.faults, o.force_g, o.forget_yaw, o.forward, o.found, o.from_faces, o.from_rest,
        o.from_tilt, o.g, o.gain_rows, o.generation, o.go_on_with, o.gyro_bias, o.gyro_scale,
        o.headings, o.isfinite, o.knots, o.level_of, o.limit, o.load_calibration, o.load_for,
        o.loaded, o.mean, o.meaning, o.merged, o.missing, o.motion, o.nearest, o.nose_up, o.off,
        o.orientation, o.over_range, o.p00, o.p01, o.p11, o.part, o.partition, o.pin_out_1,
        o.pin_out_2, o.pin_out_3, o.pin_out_4, o.pin_scl, o.pin_sda, o.place_in, o.plumb, o.pose,
        o.poses, o.predicted, o.px, o.py, o.rb, o.readings, o.refine, o.rename, o.response,
        o.save_calibration, o.saved, o.scale1, o.sigma, o.solve, o.span_s, o.square, o.stat,
        o.stored, o.target, o.text, o.tilt_deg, o.trim, o.trust_g, o.used, o.variance, o.view,
        o.wb, o.with_slopes, o.word, o.xyz, o.yaw, o.young,
    )
