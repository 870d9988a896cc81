# SPDX-License-Identifier: MIT
"""What the virtual port's tests share: a device with 256 registers, and a way to hold a line."""

ADDRESS = 0x68


class Ram:
    """A slave with 256 registers and an auto-incrementing pointer; `refuse_at` NACKs that byte."""

    int_level, on_int = 0, None

    def __init__(self, address=ADDRESS):
        self.address, self.registers = address, bytearray(range(256))
        self.pointer, self.first, self.now_ns = 0, True, 0
        self.refuse_at, self.count, self.reads_ns = None, 0, []

    def advance(self, now_ns):
        self.now_ns = max(self.now_ns, now_ns)

    def next_event_ns(self):
        return None

    def start(self, read):
        self.first, self.count = True, 0
        return True

    def write(self, value):
        if self.count == self.refuse_at:
            return False
        self.count += 1
        if self.first:
            self.pointer, self.first = value, False
        else:
            self.registers[self.pointer] = value
            self.pointer = (self.pointer + 1) % 256
        return True

    def read(self):
        value = self.registers[self.pointer]
        self.pointer = (self.pointer + 1) % 256
        self.reads_ns.append(self.now_ns)
        return value

    def stop(self):
        pass
