# SPDX-License-Identifier: MIT
"""Least squares for accelerometer poses, small enough for a board (single precision is enough).

Model: true = matrix (reading - bias). A pose is a mean reading (x, y, z) in g at rest.
"""

from math import sqrt


def from_faces(poses, faces):
    """(bias, matrix, residual_g): offset, scale and cross-axis from poses on known faces.

    faces[k] is the unit vector that pose k should read. The model is linear in matrix and
    matrix bias, so this is one 4 x 4 system for three right sides. At least four faces that span
    space; a face not quite level shows in the residual (1 degree: 17 mg). ValueError.
    """
    normal = [[0.0] * 7 for _ in range(4)]  # [sum of a a^T | sum of a t^T], a = (x, y, z, 1)
    for pose, face in zip(poses, faces):
        row = tuple(pose) + (1.0,)
        for i in range(4):
            for j in range(4):
                normal[i][j] += row[i] * row[j]
            for j in range(3):
                normal[i][4 + j] += row[i] * face[j]
    _eliminate(normal)
    matrix = tuple([normal[i][4 + j] for j in range(3) for i in range(3)])
    moved = [[-v for v in matrix[3 * i : 3 * i + 3]] + [normal[3][4 + i]] for i in range(3)]
    _eliminate(moved)  # matrix bias = -(fourth row)
    bias = tuple([moved[i][3] for i in range(3)])
    errors = []
    for pose, face in zip(poses, faces):
        errors += [t - f for t, f in zip(_true(matrix, bias, pose), face)]
    return bias, matrix, sqrt(sum([e * e for e in errors]) / len(errors))


# How far the datasheet lets bias, scale and cross-axis stray, as (1 mg of noise / that)^2:
# 50 mg, 2 %, 1 % (PS p. 13). It decides only what the poses leave open.
_PRIOR = (4e-4,) * 3 + (2.5e-3,) * 3 + (1e-2,) * 3
_PERFECT = (0.0,) * 3 + (1.0,) * 3 + (0.0,) * 3  # bias, diagonal, m01 m02 m12


def from_rest(poses):
    """(bias, matrix, residual_g) from poses whose directions nobody knows: all read 1 g.

    Gauss-Newton on |matrix (reading - bias)| - 1, with the datasheet's tolerance as prior
    knowledge; the matrix is symmetric, as a rotation cannot be seen. At least 6 poses, better 12
    and more, that span 1 g on each axis. ValueError.
    """
    if len(poses) < 6:
        raise ValueError("%d poses: at least 6 needed, 12 or more are better" % len(poses))
    for i in range(3):
        values = [pose[i] for pose in poses]
        if max(values) - min(values) < 1.0:
            raise ValueError(
                "the poses are too alike: turn %s up in some, down in others" % "xyz"[i]
            )
    p = list(_PERFECT)
    for _ in range(5):  # it converges quadratically, from 3 % in three
        normal = [[0.0] * 10 for _ in range(9)]
        for i in range(9):
            normal[i][i] = _PRIOR[i]
            normal[i][9] = _PRIOR[i] * (_PERFECT[i] - p[i])
        for pose in poses:
            error, slope = _linearise(p, pose)
            for i in range(9):
                row, factor = normal[i], slope[i]
                for j in range(i, 9):
                    row[j] += factor * slope[j]
                row[9] -= factor * error
        for i in range(9):
            for j in range(i):
                normal[i][j] = normal[j][i]
        _eliminate(normal)
        for i in range(9):
            p[i] += normal[i][9]
        if max([abs(row[9]) for row in normal]) < 1e-5:
            break
    squares = sum([_linearise(p, pose)[0] ** 2 for pose in poses])
    return tuple(p[:3]), _symmetric(p), sqrt(squares / len(poses))


def _linearise(p, pose):
    """Error of one pose and its slope by each parameter."""
    d = [pose[i] - p[i] for i in range(3)]
    m = _symmetric(p)
    t = _true(m, p, pose)
    length = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    if not 0.5 < length < 2:
        raise ValueError("the poses do not fit: was the sensor at rest in each?")
    u = [v / length for v in t]
    slope = [-(u[0] * m[i] + u[1] * m[3 + i] + u[2] * m[6 + i]) for i in range(3)]
    slope += [u[i] * d[i] for i in range(3)]
    slope += [u[i] * d[j] + u[j] * d[i] for i, j in ((0, 1), (0, 2), (1, 2))]
    return length - 1.0, slope


def _symmetric(p):
    return (p[3], p[6], p[7], p[6], p[4], p[8], p[7], p[8], p[5])


def _true(m, bias, pose):
    x, y, z = pose[0] - bias[0], pose[1] - bias[1], pose[2] - bias[2]
    return [m[3 * i] * x + m[3 * i + 1] * y + m[3 * i + 2] * z for i in range(3)]


def _eliminate(rows):
    """Solve in place: rows of [square matrix | right sides] become [identity | solutions]."""
    n = len(rows)
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        if abs(rows[best][k]) < 1e-5:
            raise ValueError("the poses are too alike: turn the sensor to more different sides")
        rows[k], rows[best] = rows[best], rows[k]
        pivot = rows[k][k]
        rows[k] = [v / pivot for v in rows[k]]
        for i in range(n):
            if i != k and rows[i][k]:
                factor = rows[i][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
