# SPDX-License-Identifier: MIT
"""Copying: files wait on the board until all are there, then take their places together."""

import base64
import time

from tools.deploy.fits import asked, chosen
from tools.deploy.link import DeployError, Gone, Link
from tools.deploy.plan import KEPT, digest, packages, planned, project, removal, there
from tools.deploy.start import started

CHUNK = 3072  # bytes of a file in one command: a fortieth of the smallest board's heap
BLOCK = 4096  # of the flash: what a file takes at least
MARGIN = 8 * BLOCK  # for folders and what the board itself writes meanwhile
SETTINGS = ("config.txt", "calibration.txt")


def deploy(port, source=False, say=print, wait_s=60, files=None):
    """Copy what differs, exchange it, restart, and say the first angle. DeployError.

    files: {path on the board: bytes} in place of the project. wait_s: silence that is borne.
    """
    with Link(port) as board:
        board.stop()
        answer = asked(board)
        say(f"{answer.machine} ({answer.platform}), MicroPython {answer.text}")
        architecture = chosen(answer, source)
        files = files or project(architecture)
        found = there(board, packages(files))
        plan = planned(files, found)
        say(f"{len(files)} files, {plan.copied} to copy")
        for path in plan.gone:
            say(f"to be removed: {path[1:]}")
        _send(board, plan, found.waiting, say)
        _exchange(board, plan, found.waiting)
        for note in plan.notes:
            say(note)
        board.reset()
        started(board, KEPT["/main.py"] in plan.notes, wait_s, say)


def uninstall(port, say=print):
    """Take off the board all that a deploy put there; the user's files stay."""
    with Link(port) as board:
        board.stop()
        plan = removal(there(board, packages(project(None))))
        _exchange(board, plan, [])
        for note in plan.notes:
            say(note)
        stay = [name for name in SETTINGS if board.ask(f"kind({'/' + name!r})")]
        removed = len(plan.gone) + len(plan.last) - 1  # but for the record of them
        say(f"removed {removed} files; stay: {', '.join(stay) or 'no settings were there'}")
        board.reset()


def _send(board, plan, waiting, say):
    """Have the files that are not there yet wait on the board."""
    names = {name: path for path, name in [*plan.new, *plan.last]}
    missing = {name: data for name, data in plan.data.items() if name not in waiting}
    _check_room(board, missing)
    began, done, total = time.monotonic(), 0, sum(map(len, missing.values())) or 1
    for count, (name, data) in enumerate(missing.items()):
        try:
            _send_one(board, name, data)
        except Gone as gone:
            raise DeployError(
                f"{gone} after {count} of {len(missing)} files. Nothing has changed on it: it "
                "starts what it had. Plug it in and run the same command, which goes on from here"
            ) from gone
        except DeployError as error:
            raise DeployError(_refused(board, error)) from error
        done += len(data)
        spent = time.monotonic() - began
        say(f"{100 * done // total:3d} %  {spent:5.1f} s  {names[name][1:]}")


def _send_one(board, name, data):
    board.run("f, made = receive()")
    for start in range(0, len(data), CHUNK):
        board.run(f"put(f, made, {base64.b64encode(data[start : start + CHUNK])!r})")
    board.run(f"whole(f, made, {name!r}, {digest(data)!r})")


def _check_room(board, missing):
    free = board.ask("os.statvfs('/')[0] * os.statvfs('/')[3]")
    need = sum(-(-len(data) // BLOCK) * BLOCK for data in missing.values())
    if missing and need + MARGIN > free:
        raise DeployError(
            f"the board's flash is full: {need + MARGIN >> 10} KB are needed, {free >> 10} KB are "
            "free. It starts what it had. Remove files of yours (mpremote fs rm), or --uninstall "
            "first, which makes room"
        )


def _refused(board, error):
    """The board raised while a file arrived: tidy up, and say what that means."""
    try:
        board.run("try:\n f.close()\nexcept OSError:\n pass")
        board.run("away(NEW + '/part')")
    except DeployError:
        pass
    if "ENOSPC" in str(error) or "Errno 28" in str(error):
        return f"the board's flash is full ({error}). It starts what it had. Remove files of yours"
    return f"the board refused a file ({error}). It starts what it had"


def _exchange(board, plan, waiting):
    if plan.nothing and not waiting:
        return
    try:
        board.run(f"exchange({plan.packages!r}, {plan.new!r}, {plan.gone!r}, {plan.last!r})")
    except Gone as gone:
        raise DeployError(
            f"{gone} while the files took their places. It starts the old program or the new one, "
            "or says that a copy was cut short. Plug it in and run the same command"
        ) from gone
