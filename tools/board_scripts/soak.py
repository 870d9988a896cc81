# SPDX-License-Identifier: MIT
# Runs on MicroPython's unix port (see tools/soak.py): the path of every tick in integers, for
# hours: the loop's accounts on wrapping ticks, the guard, the filter. HOURS, RATE_HZ, PERIOD (in
# samples), LEVEL (mdeg, roll and pitch of each sample) and BURSTS (7 words each) are set before.
# ruff: noqa: F821

import gc
from array import array

import micropython
from attitude.fixed import Attitude

from firmware.tick import judge as guard
from firmware.tick.timing import Timing, account

STEP_US = 1000000 // RATE_HZ


@micropython.viper
def put(counts: ptr16, table: ptr16, at: int):
    i = 0
    while i < 7:
        counts[i] = table[at + i]
        i += 1


@micropython.viper
def later(now: int, step: int) -> int:
    """ticks_add() of microseconds."""
    return (now + step) & 0x3FFFFFFF


def run():
    counts = array("h", [0] * 7)
    estimate = Attitude(RATE_HZ, lag_s=0.0)
    memory = guard.memory()
    guard.allow(memory, 65000)
    timing = Timing()
    now = later(0, -5000000)
    timing.follow(now)
    timing.start(STEP_US, True, now)
    words, bins = timing.words, timing.bins
    update = estimate.update
    judge = guard.judge
    late = array("i", (3, 4, 3, 60, 3, 5, 12, 3))
    n = rejected = wraps = wrong = 0
    for hour in range(HOURS + 1):  # the first is a minute to settle
        left = (3600 if hour else 60) * RATE_HZ
        worst = 0
        total = 0
        before = estimate.yaw_mdeg
        gc.collect()
        used = gc.mem_alloc()
        micropython.heap_lock()  # from here on an allocation is a MemoryError
        while left:
            left -= 1
            at = n % PERIOD
            last = now
            now = later(now, STEP_US)
            if now < last:
                wraps += 1
            if account(words, bins, now + late[n & 7]) <= 0:
                wrong += 1
            put(counts, BURSTS, 7 * at)
            if judge(counts, memory) > 0:
                rejected += 1
            update(counts)
            if not n & 7:
                error = abs(estimate.roll_mdeg - LEVEL[2 * at])
                other = abs(estimate.pitch_mdeg - LEVEL[2 * at + 1])
                if other > error:
                    error = other
                total += error
                if error > worst:
                    worst = error
            n += 1
        micropython.heap_unlock()
        used = gc.mem_alloc() - used
        mean = total * 8 // ((3600 if hour else 60) * RATE_HZ)
        turned = (estimate.yaw_mdeg - before + 540000) % 360000 - 180000
        print("hour", hour, mean, worst, turned, used, wraps, rejected, wrong)
    stats = timing.stats()
    print("end", n, stats["ticks"], stats["lost"], stats["skipped_calls"], stats["late_max_us"])


run()
