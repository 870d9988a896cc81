# SPDX-License-Identifier: MIT
"""Machine code to Python by way of p-code, one straight run of instructions at a time.

p-code is what pypcode (Ghidra's SLEIGH) says an instruction does, in operations on "varnodes":
(space, offset, size) in registers, memory, scratch or constants. Here each operation becomes a
line of Python on unsigned numbers. Registers are r[offset], scratch is a local name.
"""

from typing import Any, NamedTuple

import pypcode

from .faults import MachineFault

_ENDS_BLOCK = pypcode.TranslateFlags.BB_TERMINATING
# operations by name; {a}, {b}: operands, {m}, {h}: all ones and the sign bit of an operand,
# {n}: its bits, {out}: all ones of the result, {hex}: the second operand's number
_EXPRESSIONS = {
    "COPY": "{a}",
    "INT_ADD": "{a} + {b} & {m}",
    "INT_SUB": "{a} - {b} & {m}",
    "INT_MULT": "{a} * {b} & {m}",
    "INT_AND": "{a} & {b}",
    "INT_OR": "{a} | {b}",
    "INT_XOR": "{a} ^ {b}",
    "INT_NEGATE": "{a} ^ {m}",
    "INT_2COMP": "-{a} & {m}",
    "INT_LEFT": "({a} << {b} & {m}) if {b} < {n} else 0",
    "INT_RIGHT": "{a} >> {b}",
    "INT_SRIGHT": "({a} ^ {h}) - {h} >> {b} & {m}",
    "INT_EQUAL": "{a} == {b}",
    "INT_NOTEQUAL": "{a} != {b}",
    "INT_LESS": "{a} < {b}",
    "INT_LESSEQUAL": "{a} <= {b}",
    "INT_SLESS": "{a} ^ {h} < {b} ^ {h}",
    "INT_SLESSEQUAL": "{a} ^ {h} <= {b} ^ {h}",
    "INT_CARRY": "{a} + {b} > {m}",
    "INT_SCARRY": "(({a} ^ ~{b}) & ({a} ^ {a} + {b}) & {h}) != 0",
    "INT_SBORROW": "(({a} ^ {b}) & ({a} ^ {a} - {b}) & {h}) != 0",
    "INT_ZEXT": "{a}",
    "INT_SEXT": "({a} ^ {h}) - {h} & {out}",
    "SUBPIECE": "{a} >> 8 * {b} & {out}",
    "BOOL_NEGATE": "not {a}",
    "BOOL_AND": "{a} and {b}",
    "BOOL_OR": "{a} or {b}",
}  # fmt: skip
# what a windowed call and a change of instruction set do besides is done by Machine, or nothing
_SILENT = {"setISAMode", "rotateRegWindow", "restoreRegWindow", "swap8", "restore8"}


class Block(NamedTuple):
    """Instructions from one address to the next branch.

    run(r, load, store) executes them and returns where to go on, and where the call that ended
    them (if it was one) returns to. addresses: of the instructions; targets: where it can go on,
    those known beforehand.
    """

    run: Any
    addresses: tuple
    targets: tuple


class _Translator:
    """Makes the lines of one Block."""

    def __init__(self, processor):
        self.sizes = processor.sizes
        self.lines, self.addresses, self.targets = [], [], []
        self.here = self.next = 0
        self.ended = False

    def value(self, v):
        """A varnode as an expression."""
        space = v.space.name
        if space == "const":
            return "%d" % (v.offset & _ones(v.size))
        if space == "unique":
            return "u%x" % v.offset
        if space == "ram":
            return "load(%d, %d, %d)" % (v.offset & 0xFFFFFFFF, v.size, self.here)
        whole = self.sizes.get(v.offset, 0)
        if whole < v.size:
            raise MachineFault("a part of a register: %s" % v, self.here)
        if whole == v.size:
            return "r[%d]" % v.offset
        return "(r[%d] & %d)" % (v.offset, _ones(v.size))

    def put(self, v, expression):
        """Assign to a varnode."""
        if v.space.name == "register" and self.sizes.get(v.offset) != v.size:
            raise MachineFault("a part of a register is written: %s" % v, self.here)
        if v.space.name == "ram":
            self.lines.append("store(%d, %d, %s, %d)" % (v.offset, v.size, expression, self.here))
        else:
            self.lines.append("%s = %s" % (self.value(v), expression))

    def operation(self, op):
        """Append the lines of one operation."""
        name, inputs = op.opcode.name, op.inputs
        if name == "IMARK":
            self.here = inputs[0].offset
            self.next = self.here + inputs[0].size
            self.addresses.append(self.here)
        elif name in _EXPRESSIONS:
            self.put(op.output, self.expression(_EXPRESSIONS[name], inputs, op.output))
        elif name == "LOAD":
            address, size = self.value(inputs[1]), op.output.size
            self.put(op.output, "load(%s, %d, %d)" % (address, size, self.here))
        elif name == "STORE":
            address, value, size = self.value(inputs[1]), self.value(inputs[2]), inputs[2].size
            self.lines.append("store(%s, %d, %s, %d)" % (address, size, value, self.here))
        elif name == "CBRANCH":
            where = self.target(inputs[0])
            self.lines.append("if %s: return %s" % (self.value(inputs[1]), where))
        elif name in ("BRANCH", "CALL"):  # a call by a number stays in this function: call0
            self.end(self.target(inputs[0]))
        elif name in ("BRANCHIND", "RETURN"):
            self.end("%s, 0" % self.value(inputs[0]))
        elif name == "CALLIND":
            self.targets.append(self.next)
            self.end("%s, %d" % (self.value(inputs[0]), self.next))
        elif name != "CALLOTHER" or inputs[0].getUserDefinedOpName() not in _SILENT:
            raise MachineFault("p-code %s is not known here" % op, self.here)

    def target(self, v):
        """What the run returns to go to a known place."""
        if v.space.name != "ram":
            raise MachineFault("a jump inside an instruction", self.here)
        self.targets.append(v.offset & 0xFFFFFFFF)
        return "%d, 0" % self.targets[-1]

    def end(self, where):
        """Append the line that leaves the block; what comes after a call does nothing."""
        if not self.ended:
            self.lines.append("return " + where)
        self.ended = True

    def expression(self, template, inputs, output):
        size = 8 * inputs[0].size
        b = self.value(inputs[1]) if len(inputs) > 1 else ""
        return template.format(
            a=self.value(inputs[0]), b=b, n=size, m=(1 << size) - 1, h=1 << size - 1,
            out=_ones(output.size),
        )  # fmt: skip


def _ones(size):
    return (1 << 8 * size) - 1


def block(processor, code, base, address):
    """The Block of `code` (bytes, which stand at `base`) that begins at an address inside.

    MachineFault when there is no instruction there or one that is not known.
    """
    try:
        translate = processor.decoder.translate
        ops = translate(code, address, address - base, 0, 0, _ENDS_BLOCK).ops
    except (pypcode.BadDataError, pypcode.UnimplError) as error:
        raise MachineFault("no instruction: %s" % error, address) from None
    maker = _Translator(processor)
    for op in ops:
        maker.operation(op)
    if not maker.ended:
        maker.targets.append(maker.next)
        maker.end("%d, 0" % maker.next)
    text = "def run(r, load, store):\n " + "\n ".join(maker.lines)
    space = {}
    exec(compile(text, "<0x%X>" % address, "exec"), space)
    return Block(space["run"], tuple(maker.addresses), tuple(maker.targets))
