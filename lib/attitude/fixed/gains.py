# SPDX-License-Identifier: MIT
"""The gains of a two-state Kalman filter as a table, since they do not depend on the data."""

_RATIO = 1.35  # of the lengths of two neighbouring rows
_SETTLED = 1e-4  # change of the gain over the last tenth of its life at which the table ends


def gain_rows(rate_hz, q_angle, q_bias, r_measure):
    """The table of an angle and its gyro's bias; see rows(). k1, bias in 1/64 angle unit per
    sample for an angle unit, is the second gain.
    """
    knots = _knots(1.0 / rate_hz, q_angle, q_bias, r_measure)
    return rows(knots, 64.0 / rate_hz)


def rows(knots, scale1=1.0):
    """([first k0, first k1, rows...], shift0, shift1): straight lines between exact gains.

    knots: (sample, k0, k1). A row is (samples, change of k0, change of k1 per sample); a row of
    0 samples ends the table. The gains are times 2^(30 + shift), k1 times scale1 as well; both
    stay below 2^30.
    """
    shift0, scale0 = _scaling([k[1] for k in knots])
    shift1, more = _scaling([k[2] * scale1 for k in knots])
    scale1 *= more
    table = [int(knots[0][1] * scale0), int(knots[0][2] * scale1)]
    k0, k1 = table
    for i in range(1, len(knots)):
        n = knots[i][0] - knots[i - 1][0]
        d0 = int((knots[i][1] * scale0 - k0) / n)
        d1 = int((knots[i][2] * scale1 - k1) / n)
        table += [n, d0, d1]
        k0 += n * d0
        k1 += n * d1
    return table + [0, 0, 0], shift0, shift1


def place_in(table, samples):
    """[samples left in the row, its place, k0, k1, their changes per sample] after so many
    samples, for a table of rows().
    """
    k0, k1 = table[0], table[1]
    at = 2
    while table[at] and samples >= table[at]:
        n, d0, d1 = table[at : at + 3]
        samples -= n
        k0 += n * d0
        k1 += n * d1
        at += 3
    left, d0, d1 = table[at : at + 3]
    if left:
        left -= samples
        k0 += samples * d0
        k1 += samples * d1
    return [left, at, k0, k1, d0, d1]


def _scaling(values):
    largest = max([abs(v) for v in values])
    if largest >= 1.0:
        raise ValueError("q_angle or q_bias too large for this rate and r_measure")
    shift = 0
    while shift < 14 and largest * (2 << shift) < 1.0:
        shift += 1
    return shift, 1073741000.0 * (1 << shift)


def _knots(dt_s, q_angle, q_bias, r_measure):
    """(sample, k0, k1) of the recursion of paper 000, eqs. 18-27, starting with P = 0.

    P before one sample goes to P before the one 2^k later by H + A' P (1 + G P)^-1 A, whose A, G
    and H make those of twice as long: the doubling algorithm of Riccati equations, since a board
    is slow at thousands of samples.
    """
    p = (dt_s * q_angle, 0.0, 0.0, dt_s * q_bias)
    one = (1.0, 0.0, -dt_s, 1.0), (1.0 / r_measure, 0.0, 0.0, 0.0), p
    knots = []
    n = 0
    while True:
        s = p[0] + r_measure
        k1 = p[1] / s
        knots.append((n, p[0] / s, k1))
        if n * dt_s > 30.0 or (len(knots) > 8 and abs(k1 - knots[-2][2]) <= _SETTLED * abs(k1)):
            return knots
        due = int(n * _RATIO) + 2
        left, n, step = due - n, due, one  # made anew each time: kept, they need room
        while left:
            if left & 1:
                p = _after(p, *step)
            left >>= 1
            if left:
                step = _twice(*step)


def _twice(a, g, h):
    """A, G and H of twice as many samples."""
    turned = a[0], a[2], a[1], a[3]
    return _times(_times(a, _inverse(g, h)), a), _after(g, turned, h, g), _after(h, a, g, h)


def _after(p, a, g, h):
    """H + A' P (1 + G P)^-1 A."""
    x, y, z, w = _times(_times(p, _inverse(g, p)), a)
    return (
        h[0] + a[0] * x + a[2] * z,
        h[1] + a[0] * y + a[2] * w,
        h[2] + a[1] * x + a[3] * z,
        h[3] + a[1] * y + a[3] * w,
    )


def _inverse(g, p):
    """(1 + G P)^-1"""
    a, b, c, d = _times(g, p)
    n = (1.0 + a) * (1.0 + d) - b * c
    return (1.0 + d) / n, -b / n, -c / n, (1.0 + a) / n


def _times(a, b):
    """The product of two matrices, row by row."""
    return (
        a[0] * b[0] + a[1] * b[2],
        a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2],
        a[2] * b[1] + a[3] * b[3],
    )
