# SPDX-License-Identifier: MIT
"""How the code of a filter is loaded, for as long as that takes.

Each module comes after those that it imports, so that no import is within another one: an import
takes half a kilobyte of the stack, on an RP2 the whole of it are eight, and ticks come meanwhile.
"""

import gc
import sys

from micropython import const

from firmware.briefly import forget

_INTEGER = (
    "attitude",
    "attitude.fixed",
    "attitude.counts",
    "attitude.fixed.folding",
    "attitude.fixed.intmath",
    "attitude.fixed.base",
    "attitude.fixed.gap",
)
_FLOAT = (
    "attitude",
    "attitude.counts",
    "attitude.quaternion",
    "attitude.standing",
    "attitude.float_base",
)
_TILT = _FLOAT + ("attitude.tilt", "attitude.float_tilt")
# by the knob filter; the last one has the class
PARTS = {
    "attitude": _INTEGER + ("attitude.fixed.attitude",),
    "kalman2": _INTEGER
    + ("attitude.fixed.gains", "attitude.fixed.kalman_step", "attitude.fixed.kalman_tilt2"),
    "float.attitude": _FLOAT
    + (
        "attitude.level_loop",
        "attitude.bounds",
        "attitude.gyro_learning",
        "attitude.gyro_view",
        "attitude.rest",
        "attitude.up",
        "attitude.slow",
        "attitude.attitude",
        "attitude.float_attitude",
    ),
    "float.kalman": _TILT + ("attitude.kalman_tilt",),
    "float.complementary": _TILT + ("attitude.complementary",),
}
_CLASS = {
    "attitude": "Attitude",
    "kalman2": "KalmanTilt2",
    "float.attitude": "FloatAttitude",
    "float.kalman": "KalmanTilt",
    "float.complementary": "Complementary",
}


_KB = {"attitude": 45, "float.attitude": 42}  # of heap, the code on a board with 32 bits
_FEW_KB = const(9)  # the others'
_free = getattr(gc, "mem_free", None)  # a PC, which has enough, knows no such number


def load(name):
    """(class, what it is told first) of the filter of this name. MemoryError, at once where it is
    clear, since a heap that gets full is searched again and again before that is said."""
    new = [part for part in PARTS[name] if part not in sys.modules]
    if PARTS[name][-1] in new:
        gc.collect()
        if _free and _free() < 1000 * _KB.get(name, _FEW_KB):
            raise MemoryError
    try:
        for part in new:
            __import__(part)
    except BaseException:  # no heap for the rest: what has come by then is of no use
        forget(new)
        raise
    kind = getattr(sys.modules[PARTS[name][-1]], _CLASS[name])
    if PARTS[name][: len(_TILT)] == _TILT:
        return sys.modules[_TILT[-1]].FloatTilt, (kind,)
    return kind, ()


def unload(names, kept):
    """The code of the filters `names`, but for what those in `kept` need, is heap again."""
    for name in names:
        forget([part for part in PARTS[name] if not _needed(part, kept)])


def _needed(part, names):
    for name in names:
        if part in PARTS[name]:
            return True
    return False
