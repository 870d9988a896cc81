# SPDX-License-Identifier: MIT
"""A soft tick among hard ones, for instance of two Apps with a float and an integer filter on the
same wires: what it does on the bus, the others come in between. So it holds it. Loaded by those.
"""

import micropython


def wire(lock, start, poll):
    """Both with the bus held: of a soft tick among hard ones, which come in between."""

    @micropython.native
    def held_start(lock=lock, start=start):
        lock[0] += 1
        try:
            start()
        finally:
            lock[0] -= 1

    @micropython.native
    def held_poll(first, second, rest, lock=lock, poll=poll):
        lock[0] += 1
        try:
            return poll(first, second, rest)
        finally:
            lock[0] -= 1

    return held_start, held_poll
