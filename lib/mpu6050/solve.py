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


def from_rest(poses):
    """(bias, matrix, residual_g) from poses whose directions nobody knows: all read 1 g.

    9 poses or more: offset, scale and cross-axis (a symmetric matrix, as a rotation cannot be
    seen); 6 to 8: offset and scale. Gauss-Newton on |matrix (reading - bias)| - 1.
    ValueError when the poses are too few or too alike.
    """
    n = len(poses)
    if n < 6:
        raise ValueError("%d poses: 6 give offset and scale, 9 cross-axis too" % n)
    size = 9 if n >= 9 else 6
    p = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]  # bias, diagonal, m01, m02, m12
    for _ in range(8):
        normal = [[0.0] * (size + 1) for _ in range(size)]
        for pose in poses:
            error, slope = _linearise(p, pose)
            for i in range(size):
                for j in range(size):
                    normal[i][j] += slope[i] * slope[j]
                normal[i][size] -= slope[i] * error
        _eliminate(normal)
        for i in range(size):
            p[i] += normal[i][size]
    squares = sum([_linearise(p, pose)[0] ** 2 for pose in poses])
    return tuple(p[:3]), _symmetric(p), sqrt(squares / max(1, n - size))


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
        if abs(rows[best][k]) < 1e-4:
            raise ValueError("the poses are too alike: turn the sensor to more different sides")
        rows[k], rows[best] = rows[best], rows[k]
        pivot = rows[k][k]
        rows[k] = [v / pivot for v in rows[k]]
        for i in range(n):
            if i != k and rows[i][k]:
                factor = rows[i][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
