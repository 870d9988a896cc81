# SPDX-License-Identifier: MIT
"""Hard interrupts: Python that runs at once, between any two instructions of the program.

The heap is locked in there. CPython cannot see an allocation, but it sees the calls that allocate,
wait or print: those are refused, and stand in `port.errors` even when the callback catches them.
"""

import sys
import traceback

from .outputs import VirtualReset

CALL_NS = 22_000  # of an empty callback; measured on an RP2040 at 125 MHz, MicroPython 1.26.1


class HardInterrupts:
    """The hard callbacks of a Port; `active` while one runs."""

    def __init__(self, port):
        self.port = port
        self.active = False

    def call(self, function, argument, complaint):
        """Call as a hard interrupt; False when it raised, which disables it for good.

        Whatever it raises, a KeyboardInterrupt too; only a reset of the board goes on.
        """
        heap = self.port.modules["micropython"]
        self.active = True
        heap.heap_lock()
        fine = True
        try:
            function(argument)
        except VirtualReset:
            raise
        except BaseException as error:
            print(complaint, file=sys.stderr)
            traceback.print_exception(error, file=sys.stderr)
            self._note(error)
            fine = False
        finally:
            heap.heap_unlock()
            self.active = False
        self.port.clock.hold(CALL_NS)
        return fine

    def refuse(self, what, error=RuntimeError):
        """Raise `error`, and note it, when it is a hard callback that does `what`."""
        if self.active:
            found = error("%s in a hard interrupt" % what)
            self._note(found)
            raise found

    def _note(self, error):
        if not any(error is known for known in self.port.errors):
            self.port.errors.append(error)
