# SPDX-License-Identifier: MIT
"""Knobs in a fast turn on the emulated RP2040: what they cost in ticks, time and yaw."""

import ast

from tools.loop.run import START, board_for

_SETTLE = """
time.sleep_ms(100)
def change(changes, pause_ms):
    rows = []
    for name, value in changes:
        lost, first = app.stats()["lost"], app.sample()
        began = time.ticks_us()
        app.set(name, value)
        while not app.fresh:
            pass
        took = time.ticks_diff(time.ticks_us(), began)
        lost = app.stats()["lost"] - lost
        time.sleep_ms(pause_ms)
        last = app.sample()
        us = time.ticks_diff(last.t_us, first.t_us)
        rows.append((name, took, lost, last.yaw_deg - first.yaw_deg, us, last.uncertain))
    return rows
"""


class Spin:
    """A turn about the vertical at rate_dps, which may be set; it swells within 50 ms."""

    duration_s = None

    def __init__(self):
        self.rate_dps = self._before = self._since_s = 0.0

    def turn(self, rate_dps, now_s):
        """From now on at this rate."""
        self._before, self.rate_dps, self._since_s = self.rate_dps, rate_dps, now_s

    def at(self, t):
        share = min(max((t - self._since_s) / 0.05, 0.0), 1.0)
        rate = self._before + share * (self.rate_dps - self._before)
        return (0.0, 0.0, 1.0, 0.0, 0.0, rate, 25.0)

    def truth(self, t):
        raise NotImplementedError("nobody asks here for more than differences")


def changed(board, spin, rate_dps, changes, pause_ms):
    """(name, us of set() and until a good sample, ticks lost, degrees of yaw off) of each."""
    spin.turn(rate_dps, board.nanos * 1e-9)
    board.run_ms(100)
    out = board.exec("print('=', change(%r, %d))" % (changes, pause_ms), 120)
    found = []
    for name, took, lost, turned, us, doubt in ast.literal_eval(out.partition("=")[2].strip()):
        assert not doubt
        off = (turned - rate_dps * us * 1e-6 + 180) % 360 - 180
        print("%3d deg/s %-20s %7d us %3d lost %+.3f deg" % (rate_dps, name, took, lost, off))
        found.append((name, took, lost, off))
    return found


def test_knobs_in_a_turn_keep_the_yaw():
    spin = Spin()
    board, _ = board_for("1.26.1", spin)
    with board:
        board.exec(START + _SETTLE, 60)
        set_up = [("gyro_dps", 1000), ("dlpf_hz", 94), ("rate_hz", 500)]
        for _, took, _, off in changed(board, spin, 100.0, set_up, 30):
            assert took < 100000 and abs(off) < 0.5
        filters = [(name, value) for value in (3.0, 2.0, 1.0, 1.5) for name in (
            "attitude_tau_s", "attitude_rest_tau_s", "attitude_bias_tau_s")]  # fmt: skip
        found = changed(board, spin, 200.0, filters, 12)
        assert len(found) == 12
        assert all(lost == 0 for _, _, lost, _ in found)
        # the foreground's work falls anywhere into what a knob calls, where the stack is deep
        deep = [("attitude_tau_s", 1.0 + k / 100) for k in range(60)]
        assert [lost for _, _, lost, _ in changed(board, spin, 0.0, deep, 0)] == [0] * 60
        assert max(abs(off) for *_, off in found) < 0.1
