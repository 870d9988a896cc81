# SPDX-License-Identifier: MIT
"""The board's watchdog, which nothing stops once it runs: good ticks feed it.

Where the loop stands still on purpose (a start, a self-test: outputs are safe) a timer feeds it,
for a while: what hangs there still ends in a reset.
"""

from micropython import const

_PERIOD_US = const(500000)  # the shortest watchdog is 2 s
_HALF_A_MINUTE_S = const(30)


class Feeding:
    """`with Feeding(app): ...`; does nothing where no watchdog runs."""

    def __init__(self, app, most_s=_HALF_A_MINUTE_S):
        self._app = app
        self._timer = None
        self._left = 2 * most_s

    def __enter__(self):
        if self._app.outputs.feed:
            self._timer = self._app.board.timer(_PERIOD_US, self._tick)

    def __exit__(self, *error):
        if self._timer:
            self._timer.deinit()
            self._timer = None

    def _tick(self, _timer):
        if self._left:
            self._left -= 1
            self._app.outputs.feed()
