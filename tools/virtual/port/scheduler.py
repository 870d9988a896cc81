# SPDX-License-Identifier: MIT
"""MicroPython's scheduler: a queue of eight callbacks that run between bytecodes of the main
program.
"""

from collections import deque

DEPTH = 8


class Scheduler:
    """Soft callbacks wait here; `run()` runs one, and callbacks never pre-empt each other."""

    def __init__(self, report=None, depth=DEPTH):
        self.report = report  # takes the exception of a callback; None lets it through
        self.depth = depth
        self.queue = deque()
        self.dropped = 0
        self.running = False
        self.pressed = False  # a Ctrl-C that the main program has not got yet

    def offer(self, function, argument):
        """Queue `function(argument)`; False, and nothing else, when the queue is full."""
        if len(self.queue) >= self.depth:
            self.dropped += 1
            return False
        self.queue.append((function, argument))
        return True

    def run(self):
        """Run the first that waits, unless a callback is running already: one for each check."""
        if self.running or not self.queue:
            return
        self.running = True
        try:
            function, argument = self.queue.popleft()
            self._call(function, argument)
        finally:
            self.running = False
        if self.pressed:
            self.pressed = False
            raise KeyboardInterrupt

    def _call(self, function, argument):
        try:
            function(argument)
        except (Exception, KeyboardInterrupt) as error:  # a Ctrl-C is lost here, as on a board
            if self.report is None:
                raise
            self.report(error)
