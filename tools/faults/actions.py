# SPDX-License-Identifier: MIT
"""Faults that are none of the bus: in the board's own timers, ticks and programs."""

from tools.virtual.motion import FreeMotion

_TICKS_S = (1 << 30) / 1e6
_START_BEFORE_WRAP_S = 2.0  # tools.virtual.port.ticks


def lose_callbacks(rig, for_s):
    """The queue of soft callbacks is full all the time; a hard tick loses its interrupts."""
    if rig.app.tick_kind == "hard":
        rig.port.clock.masked(round(for_s * 1e9))
        return
    scheduler = rig.port.clock.scheduler
    depth, scheduler.depth = scheduler.depth, 0
    rig.run(for_s)
    scheduler.depth = depth


def user_raises(rig, for_s):
    """A function that the user added raises at every step."""

    def update(app):
        raise ValueError("in the user's own function")

    outputs = rig.app.outputs
    outputs.add(update)
    rig.run(for_s)
    outputs.remove(update)


def wrap(rig, for_s):
    """ticks_us passes its wrap; the app, and what it counts, is started anew shortly before."""
    rig.app.stop()
    passed = (rig.now_s + _TICKS_S - _START_BEFORE_WRAP_S) % _TICKS_S
    lead_s = rig.random.uniform(5.0, 5.5)
    rig.run((_TICKS_S - passed - lead_s) % _TICKS_S)
    rig.bus.advance(rig.port.now_ns)
    moves = FreeMotion(round(passed), rest_s=1.2)
    for chip in rig.chips:
        chip.set_motion(moves, restart=True)
    for _ in range(5):  # the chip's low-pass forgets the motion before
        rig.app.imu.read()
        rig.run(0.01)
    rig.start()
    before = rig.stats()
    rig.run(_TICKS_S - (rig.now_s + _TICKS_S - _START_BEFORE_WRAP_S) % _TICKS_S)
    return before
