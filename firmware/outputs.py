# SPDX-License-Identifier: MIT
"""What the estimate drives: functions called after each step, with a safe state each.

They are the user's, so they are isolated: an exception is counted and shown once, the loop lives.
"""

import sys


class Outputs:
    """Functions of one argument, the app. `failed` counts their exceptions.

    feed: the watchdog's function, or None; active: whether there is anything to call.
    """

    def __init__(self):
        self._updates = []
        self._safes = []
        self._is_safe = False
        self.active = False
        self.feed = None
        self.failed = 0
        self.error = None

    def add(self, update, safe=None):
        """Call `update(app)` after each step; `safe()` once when the estimate has gone stale."""
        self._updates.append(update)
        self.active = True
        if safe is not None:
            self._safes.append(safe)

    def watch(self, feed):
        """Call `feed()`, a watchdog's, after each good step."""
        self.feed = feed
        self.active = True

    def clear(self):
        """Take all functions away, their outputs safe."""
        self.safe()
        self.active = self.feed is not None
        self._updates.clear()
        self._safes.clear()

    def write(self, app, fresh, stale):
        """One tick; allocates nothing unless the functions do.

        fresh: it had a new good burst; then, and when no function fails, the watchdog is fed.
        """
        if stale:
            self.safe()
            return
        self._is_safe = False
        failed = self.failed
        for update in self._updates:
            try:
                update(app)
            except Exception as error:
                self._failed(error)
        if fresh and self.feed is not None and failed == self.failed:
            self.feed()

    def safe(self):
        """Put every output into its safe state, once until the next write."""
        if self._is_safe:
            return
        self._is_safe = True
        for safe in self._safes:
            try:
                safe()
            except Exception as error:
                self._failed(error)

    def _failed(self, error):
        self.failed += 1
        if self.error is None:
            sys.print_exception(error)
        self.error = error
