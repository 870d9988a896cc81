# SPDX-License-Identifier: MIT
"""Names that code brings which is loaded for a moment (python -m tools.names writes this): heard
before it, they lie together and are no islands in the heap when it has gone. MicroPython keeps
names in pools of 20, 40, ... 640; the next, from the 1261st on, takes 9 KB in one piece.
"""

_NAMES = (
    " %.3g %s| = | or |%+.1f %%|%r: %r|%s %s %s|%s = %s|%s%s: %s|%s: %s|+|+-|+x|+z|, |-|.new|.old",
    "/lib/attitude/bounds.mpy|/lib/attitude/complementary.mpy",
    "/lib/attitude/fixed/attitude/claims.mpy|/lib/attitude/fixed/gains.mpy",
    "/lib/attitude/fixed/kalman_step.mpy|/lib/attitude/fixed/kalman_tilt2.mpy",
    "/lib/attitude/float_base.mpy|/lib/attitude/float_tilt.mpy|/lib/attitude/kalman_tilt.mpy",
    "/lib/calibration/fields.mpy|/lib/calibration/mounting.mpy|/lib/calibration/poses.mpy",
    "/lib/calibration/rest.mpy|/lib/calibration/solve.mpy|/lib/mpu6050/selftest.mpy|Axis|BAD",
    "Begin|Bounds|Complementary|FloatTilt|FromCounts|KalmanTilt|KalmanTilt2|Knob|NotStill|PARTS",
    "Poses|Stats|YAW_NOISE|_CLAIMED_DEG|_CLASS|_DOUBTED_DEG|_DOUBTFUL_MG|_EDITED|_FACES|_FIELDS",
    "_FLOAT|_FORGOTTEN|_FRESH|_GENERATION_MAX|_GROUPS|_HELP|_INTEGER|_KB|_KNOWN_SCALE|_LEAST_DEG",
    "_LINES_MAX|_LINE_MAX|_LONGEST_US|_MEANINGS|_NAMES|_OVER|_PERFECT|_PRIOR|_Part|_Q15|_Q20|_Q26",
    "_RATIO|_SETTLED|_SHAKEN|_SHAKEN_S|_SIZE_MAX|_SLOPE_SPAN_C|_TILT|_UNIT_PER_DEG|_WAYS",
    "_WORTH_DPS|_WORTH_SCALE|_YAW|_axis|_biases|_brought|_crc_line|_determinant|_dot|_eliminate",
    "_explained|_folding|_free|_generation|_home|_inverse|_knob|_knots|_levelled|_linearise",
    "_lines|_mean|_needed|_nominal16|_not_still|_number|_numbers|_of|_over|_parse|_path|_period16",
    "_poses|_rests|_run_for|_same_again|_sample|_scalar|_scaling|_set_angles|_sigma|_solved",
    "_square|_squares|_started|_stored|_symmetric|_tell|_temps|_text|_tidied|_times|_trims",
    "_trims_6500|_true|_twice|_unit|_up|_update|_value|_variance|_with|_yaw|accel_angle_deg|acos",
    "age_ms|alpha|attitude.bounds|attitude.complementary|attitude.fixed.attitude",
    "attitude.fixed.gains|attitude.fixed.kalman_step|attitude.fixed.kalman_tilt2",
    "attitude.float_base|attitude.float_tilt|attitude.kalman_tilt|axes|axis|balance_kd|balance_kp",
    "base|beginning|bias_forgotten|binascii|block_s|bounds|calibration.mounting|calibration.poses",
    "calibration.rest|calibration.solve|centre|choices|claims|cold|complementary|core|cores|crc",
    "crc32|decode|default|deg/s|diagnose|doubtful|drift|e|encode|explained|face|faces|faults",
    "firmware.diagnose|firmware.faults.policy|firmware.settings|firmware.startup|firmware.store",
    "firmware.texts|firmware/beginning.mpy|firmware/calibrating.mpy|firmware/calibration.mpy",
    "firmware/first.mpy|firmware/levelling.mpy|firmware/loading.mpy|firmware/report.mpy",
    "firmware/startup.mpy|firmware/stats.mpy|firmware/store.mpy|firmware/texts.mpy|float_base",
    "float_tilt|folding|force_g|forget_yaw|forward|found|from_faces|from_rest|from_tilt|g",
    "gain_rows|gains|generation|go_on_with|gyro_bias|gyro_scale|headings|intmath|isfinite",
    "kalman_step|kalman_tilt|kalman_tilt2|knots|level_of|limit|load_calibration|load_for|loaded",
    "loading|mean|meaning|merged|missing|motion|moved: |mpu6050.selftest|nearest|nose_up|off",
    "one of |orientation|over_range|p00|p01|p11|part|partition|pin_out_1|pin_out_2|pin_out_3",
    "pin_out_4|pin_scl|pin_sda|place_in|plumb|pose|poses|predicted|px|py|rate_dps|rb|readings",
    "refine|rename|response|save_calibration|saved|scale1|selftest|sigma|solve|span_s|square|stat",
    "stored|target|text|tilt|tilt_deg|too long|trim|trust_g|used|variance|view|wb|with_slopes",
    "word|xyz|yaw|young|{%s}|~",
)


def hear():
    """MicroPython keeps them from now on."""
    for row in _NAMES:
        for name in row.split("|"):
            getattr(None, name, None)
