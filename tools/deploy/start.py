# SPDX-License-Identifier: MIT
"""After a restart: the first angle, or what the board says instead."""

import re
import time

from tools.deploy.link import DeployError

ANGLE = re.compile(r"^roll\S* *-?\d[^\n]*\n", re.MULTILINE)
PROMPT = ">>> "
REBOOT = "soft reboot\n"
LOOK_S = 0.02
OVERALL = 3  # times the silence that is borne


def started(board, own, wait_s, say):
    """Wait for the first line of a Link's board. DeployError with what it printed instead.

    own: main.py is the user's, of whom nothing is expected. wait_s: silence that is borne.
    """
    said = _listen(board, wait_s if own else wait_s / 4)
    if not own and not ANGLE.search(said):
        board.soft_reset()  # what it printed before its port was open again is lost: once more
        said = _listen(board, wait_s, after=REBOOT)
    angle = ANGLE.search(said)
    if angle:
        for line in said[: angle.start()].splitlines():
            if line and not line.startswith("#"):
                say(line)
        say(f"it runs: {angle.group().strip()}")
        say(f"more with: mpremote connect {board.port} resume exec 'app.watch()'")
    elif own:
        say("your main.py has printed: " + (said.strip() or "nothing"))
    else:
        raise DeployError(
            "all is copied, but no angle comes. The board says:\n"
            + (said.strip() or f"nothing for {wait_s:g} s")
        )


def _listen(board, wait_s, after=""):
    """What the board prints (after a mark), until an angle, its prompt, or silence."""
    said, text = "", ""
    began = last = time.monotonic()
    while last + wait_s > time.monotonic() and time.monotonic() < began + OVERALL * wait_s:
        data = board.heard()
        if not data:
            time.sleep(LOOK_S)
            continue
        last = time.monotonic()
        said += data.decode(errors="replace").replace("\r\n", "\n")
        _, mark, rest = said.partition(after) if after else ("", "-", said)
        text = rest if mark else ""
        if ANGLE.search(text) or text.endswith(PROMPT):
            break
    return text
