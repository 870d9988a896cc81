# SPDX-License-Identifier: MIT
"""What a function does outside the memory, logged once, then played back.

An entry is ("r" or "w", address, value) of a peripheral register, a word being unsigned; or
("c", name, result) of a call of one of the board's own functions.
"""

_SIZES = {"ptr": 1, "ptr8": 1, "ptr16": 2, "ptr32": 4}


class Memory:
    """What a viper pointer to an address is on the PC: an object with [index]."""

    def __init__(self, address, kind, access):
        self.address, self.size, self.access = address, _SIZES[kind], access

    def __getitem__(self, index):
        value = self.access("r", self.address + index * self.size, None)
        return value - (value >> 31 << 32) if self.size == 4 else value

    def __setitem__(self, index, value):
        value &= (1 << 8 * self.size) - 1
        self.access("w", self.address + index * self.size, value)


class Outside:
    """A function of the board, as `ticks_us`, in a form that the Log knows."""

    def __init__(self, name, function, log):
        self.name, self.function, self.log = name, function, log

    def __call__(self, *arguments):
        if self.log.replay is not None:
            return self.log.replay.access("c", self.name, None)
        result = self.function(*arguments)
        if self.log.on:
            self.log.entries.append(("c", self.name, result))
        return result


class Log:
    """Stands before the virtual board's registers and writes down what passes.

    It is one of the callables of the checked viper's address space, the first.
    """

    def __init__(self, space):
        self.space = space  # the list of all such callables
        self.entries = []  # of all calls so far, while `on`
        self.on = False
        self.replay = None  # a Replay that answers instead of the board

    def __call__(self, address, kind):
        if self.replay is not None:
            return Memory(address, kind, self.replay.access)
        if not self.on:
            return None
        for lookup in self.space:
            memory = None if lookup is self else lookup(address, kind)
            if memory is not None:
                return Memory(address, kind, self._through(memory, address, kind))
        return None

    def _through(self, memory, base, kind):
        size = _SIZES[kind]

        def access(how, address, value):
            index = (address - base) // size
            if how == "r":
                value = memory[index] & (1 << 8 * size) - 1
            else:
                memory[index] = value - (value >> 31 << 32) if size == 4 else value
            self.entries.append((how, address, value))
            return value

        return access


class Replay:
    """Plays a log back; LookupError at the first access that is not the log's next."""

    def __init__(self, entries):
        self.entries = entries
        self.at = 0

    def access(self, how, address, value):
        """Answer a read, or compare a write."""
        wanted = self.entries[self.at] if self.at < len(self.entries) else ("nothing", 0, None)
        if (how, address) != wanted[:2] or (how == "w" and value != wanted[2]):
            told = _told(how, address, value), _told(*wanted)
            raise LookupError("outside: %s, expected %s" % told)
        self.at += 1
        return wanted[2]


def _told(how, address, value):
    if how == "nothing":
        return how
    if how == "c":
        return "call of " + address
    text = "0x%08X" % address
    return "read of " + text if how == "r" else "write of 0x%X to %s" % (value, text)
