# SPDX-License-Identifier: MIT
"""What the estimate drives: functions called after each step, with a safe state each.

They are the user's, so they are isolated: an exception is counted and shown once, the loop lives.
"""

import sys


class Outputs:
    """Functions of one argument, the app. `failed` counts their exceptions.

    active: whether there is any function.
    """

    def __init__(self):
        self._updates = []
        self._safes = []
        self._is_safe = False
        self.active = False
        self.failed = 0
        self.error = None

    def add(self, update, safe=None):
        """Call `update(app)` after each step; `safe()` once when the estimate has gone stale."""
        self._updates.append(update)
        self.active = True
        if safe is not None:
            self._safes.append(safe)

    def clear(self):
        """Take all functions away, their outputs safe."""
        self.safe()
        self.active = False
        self._updates.clear()
        self._safes.clear()

    def write(self, app, stale):
        """One tick; allocates nothing unless the functions do. False when one has failed."""
        if stale:
            self.safe()
            return False
        self._is_safe = False
        failed = self.failed
        for update in self._updates:
            try:
                update(app)
            except Exception as error:
                self._failed(error)
        return failed == self.failed

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
