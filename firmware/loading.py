# SPDX-License-Identifier: MIT
"""How the code of a filter is loaded, for as long as that takes.

Each module comes after those that it imports, so that no import is within another one: an import
takes half a kilobyte of the stack, on an RP2 the whole of it are eight, and ticks come meanwhile.
"""

import gc
import sys

from micropython import const

from firmware.briefly import Briefly

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


def load(name, loaded, used):
    """loaded[name] becomes (class, what it is told first) of the filter of this name. MemoryError
    where there is no room, not even without the code of those in `loaded` that are not in `used`,
    {bit of an App: the filter that it runs with}."""
    for last in (False, True):
        try:
            loaded[name] = _load(name)
            return
        except MemoryError:
            if last:
                raise
        unload(loaded, used)
        gc.collect()


def _load(name):
    new = [part for part in PARTS[name] if part not in sys.modules]
    if PARTS[name][-1] in new:
        gc.collect()
        # said at once where it is clear: a heap that gets full is searched again and again
        if _free and _free() < 1000 * _KB.get(name, _FEW_KB):
            raise MemoryError
    try:
        for part in new:
            __import__(part)
    except BaseException:  # no heap for the rest: what has come by then is of no use
        Briefly(*new).__exit__()
        raise
    kind = getattr(sys.modules[PARTS[name][-1]], _CLASS[name])
    if PARTS[name][: len(_TILT)] == _TILT:
        return sys.modules[_TILT[-1]].FloatTilt, (kind,)
    return kind, ()


def unload(loaded, used):
    """The code of filters in `loaded` that are not in `used` is heap again, but that of attitude:
    its pieces are too large to find room again in a heap that was used."""
    kept = list(used.values()) + ["attitude"]
    for name in list(loaded):
        if name not in kept:
            Briefly(*[part for part in PARTS[name] if not _needed(part, kept)]).__exit__()
            del loaded[name]


def _needed(part, names):
    for name in names:
        if part in PARTS[name]:
            return True
    return False
