# SPDX-License-Identifier: MIT
"""What recordings with optical truth are written in; tools.recordings reads them by this.

.npz    acc_m_s2, gyr_rad_s (n x 3), quat_wxyz (n x 4, sensor to earth, NaN where the cameras lost
        it), movement (n, true where errors count), rate_hz
.mat    BROAD's: imu_acc, imu_gyr, opt_quat, movement, sampling_rate
.csv    RepoIMU's: two lines of names with semicolons, the body's attitude relative to its first
        one, m/s2 and rad/s
.csv    one's own: a line of names, t_s, gx_dps, gy_dps, gz_dps, ax_g, ay_g, az_g, qw, qx, qy, qz
        in any order, and movement (0 or 1) if there is one; lines with # are comments; a
        quaternion (sensor to earth, z up) may be left empty where it is unknown

Each reader gives (rate_hz, accel m/s2, gyro rad/s, quat, movement); ValueError says what a file
lacks.
"""

import csv
from pathlib import Path

import numpy as np

G = 9.80665
OWN = ("t_s", "gx_dps", "gy_dps", "gz_dps", "ax_g", "ay_g", "az_g", "qw", "qx", "qy", "qz")
_MOVES_DPS = 10.0  # where nobody says what motion is: between the first and the last of it
_STILL_S = 0.5  # at the start, by which a frame's vertical is found
_ALIKE = 0.001  # (rad/s)^2: about an axis that turns by less the body's axes are the sensor's


def read(path):
    """By the file's name and first line."""
    path = Path(path)
    if path.suffix == ".mat":
        return mat(path)
    if path.suffix == ".csv":
        with path.open() as file:
            first = file.readline()
        return repo_imu(path) if first.startswith("Time") and ";" in first else own(path)
    return _named(path, np.load(path), ("rate_hz", "acc_m_s2", "gyr_rad_s", "quat_wxyz",
                                        "movement"))


def mat(path):
    """BROAD's."""
    from scipy.io import loadmat

    names = ("sampling_rate", "imu_acc", "imu_gyr", "opt_quat", "movement")
    return _named(path, loadmat(path, variable_names=list(names)), names)


def _named(path, data, names):
    _complain(path, [name for name in names if name not in data])
    return float(np.asarray(data[names[0]]).ravel()[0]), *(data[name] for name in names[1:])


def _complain(path, missing):
    if missing:
        raise ValueError(f"{path}: no {', '.join(missing)} in it")


def own(path):
    """One's own csv."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    _complain(path, [name for name in OWN if not rows or name not in rows[0]])
    t, *sensors = (_column(rows, name) for name in OWN)
    gyro, accel, quat = np.radians(sensors[:3]).T, G * np.transpose(sensors[3:6]), sensors[6:]
    movement = _column(rows, "movement") > 0 if "movement" in rows[0] else moving(gyro)
    return (len(t) - 1) / (t[-1] - t[0]), accel, gyro, np.transpose(quat), movement


def _column(rows, name):
    return np.array([float(row[name] or "nan") for row in rows])


def repo_imu(path):
    """RepoIMU's: the truth is turned so that up is z and the body's axes are the sensor's."""
    rows = []
    with path.open() as file:
        for line in list(file)[2:]:
            cells = line.strip().rstrip(";").split(";")[:11]
            if len(cells) == 11:
                rows.append([float(cell or "nan") for cell in cells])
    if len(rows) < 100:
        raise ValueError(f"{path}: no samples in it")
    table = np.array(rows)
    rate_hz = (len(table) - 1) / (table[-1, 0] - table[0, 0])
    quat, accel, gyro = table[:, 1:5], table[:, 5:8], table[:, 8:11]
    quat[np.abs(np.linalg.norm(quat, axis=1) - 1) > 0.01] = np.nan
    quat = aligned(quat, gyro, rate_hz)
    up = accel[: max(1, round(_STILL_S * rate_hz))].mean(axis=0)
    return rate_hz, accel, gyro, levelled(quat, up), moving(gyro)


def aligned(quat, gyro, rate_hz):
    """`quat` of the body as one of the sensor: turned by the rotation by which the rates of the
    truth agree best with the gyro's (Kabsch); none where the motion tells of none."""
    turn = _product(quat[:-1] * (1, -1, -1, -1), quat[1:])
    rates = 2 * rate_hz * turn[:, 1:] * np.sign(turn[:, :1])
    known = ~np.isnan(rates).any(axis=1)
    agree = rates[known].T @ gyro[1:][known] + _ALIKE * known.sum() * np.eye(3)
    u, _, v = np.linalg.svd(agree)
    rotation = u @ np.diag((1, 1, np.sign(np.linalg.det(u @ v)))) @ v  # sensor to body
    return _product(quat, np.broadcast_to(_of_matrix(rotation), quat.shape))


def levelled(quat, up):
    """`quat` with an earth whose z is where `up` (sensor axes, of the first samples) points."""
    first = quat[~np.isnan(quat).any(axis=1)][:1]
    pure = np.concatenate([[0.0], up / np.linalg.norm(up)])[None]
    x, y, z = _product(_product(first, pure), first * (1, -1, -1, -1))[0, 1:]
    lift = np.array([1 + z, y, -x, 0.0])  # the shortest way from there to z
    if np.linalg.norm(lift) < 1e-6:
        lift = np.array([0.0, 1.0, 0.0, 0.0])
    return _product(np.broadcast_to(lift / np.linalg.norm(lift), quat.shape), quat)


def moving(gyro):
    """True from the first to the last sample that turns, rad/s."""
    turns = np.flatnonzero(np.linalg.norm(gyro, axis=1) > np.radians(_MOVES_DPS))
    out = np.zeros(len(gyro), bool)
    if len(turns):
        out[turns[0] : turns[-1] + 1] = True
    return out


def _product(p, q):
    a, b, c, d = p.T
    w, x, y, z = q.T
    return np.stack([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
                     a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w], 1)


def _of_matrix(m):
    """The quaternion of a rotation matrix, by its eigenvector of 1 (Bar-Itzhack)."""
    k = np.array([
        [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
        [0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
        [0, 0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
        [0, 0, 0, m[2, 2] - m[0, 0] - m[1, 1]],
    ])  # fmt: skip
    k = (k + k.T - np.diag(np.diag(k))) / 3
    return np.linalg.eigh(k)[1][:, -1]
