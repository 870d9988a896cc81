# SPDX-License-Identifier: MIT
"""An output of the user's own, which may raise, and knows what was done to it last."""

ERRORS = (ValueError, MemoryError, AttributeError, IndexError, KeyError)


class Motor:
    """on: driven, and not made safe since; at_ns: when it was driven last; raised: how often its
    update or its safe() have; hard: in the tick."""

    def __init__(self, clock, hard):
        self._clock = clock
        self.hard = hard
        self.on = False
        self.at_ns = clock.now_ns
        self.fails = self.fails_once = None
        self.raised = 0

    def update(self, app):
        """Driven."""
        if self.fails:
            self.raised += 1
            raise self.fails("in the user's update")
        self.on = True
        self.at_ns = self._clock.now_ns

    def safe(self):
        """Its safe value."""
        if self.fails_once:
            error, self.fails_once = self.fails_once, None
            self.raised += 1
            raise error("in the user's safe")
        self.on = False
