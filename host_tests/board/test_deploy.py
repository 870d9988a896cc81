# SPDX-License-Identifier: MIT
"""tools.deploy on the emulated board: what is copied, what a cut leaves, whose files stay.

Most of it with a small program whose every module says which version it is of.
"""

import re

import pytest

from host_tests.board.deploy_rig import deployed, run
from host_tests.board.power_cut_rig import flash_of, noises
from tools.deploy import copy
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040 import flash
from tools.virtual.rp2040.flash import read_image
from tools.virtual.rp2040.flash_cuts import cuts

# Printing while the emulated USB connects, in the first 20 ms, can jam it: so it waits.
MAIN = """import time
time.sleep_ms(100)
from firmware.app import A, B
import attitude, control
print("versions", {n}, A, B, attitude.V, control.V, BOOT)
print("roll_deg: 1.00")
"""


def program(n):
    """{path: bytes} of version n; a module less and one more from version to version."""
    texts = {
        "/boot.py": f"BOOT = {n}\n",
        "/main.py": MAIN.format(n=n),
        "/firmware/app.py": f"from firmware.sub{n}.b import V as B\nA = {n}\n",
        f"/firmware/sub{n}/b.py": f"V = {n}\n",
        "/firmware/same.py": "# as before\n",
        "/lib/attitude/__init__.py": f"from attitude.part import V\n# {n}\n",
        "/lib/attitude/part.py": f"V = {n}\n",
        "/lib/control/__init__.py": f"V = {n}\n",
    }
    return {path: text.encode() for path, text in texts.items()}


@pytest.fixture(scope="module")
def pico():
    with VirtualPico(files={"config.txt": "mine\n"}, mpy=False) as board:
        yield board


def names(files):
    return {"/" + name for name in files}


def test_a_new_board_gets_all_and_starts_it(pico):
    done = deployed(pico, program(1))
    assert done.error is None
    assert "RP2040" in done.text and "8 files, 8 to copy" in done.text
    assert "versions 1 1 1 1 1 1" in done.said and "it runs: roll_deg: 1.00" in done.said
    there = pico.files()
    assert names(there) == {*program(1), "/plumb.json", "/config.txt"}
    assert all(there[path[1:]] == data for path, data in program(1).items())


def test_again_without_a_change_copies_nothing_in_no_time(pico):
    done = deployed(pico, program(1))
    print(f"{done.seconds:.2f} s")
    assert "8 files, 0 to copy" in done.text and "it runs" in done.text
    assert done.seconds < 5


def within(files, package):
    return {path: data for path, data in files.items() if path.startswith(f"/{package}/")}


def versions(files):
    """Which program these files start: {1}, {2}, set() for none, {1, 2} for a mixture.

    Only what can be imported counts, and who imports: our main.py needs firmware.
    """
    found = set()
    for package in ("firmware", "lib/attitude", "lib/control"):
        here = within({f"/{path}": data for path, data in files.items()}, package)
        if not here:
            continue  # an ImportError: it takes no part in a mixture
        fits = [n for n in (1, 2) if here == within(program(n), package)]
        found |= set(fits) or {1, 2}
    if not any(path.startswith("firmware/") for path in files):
        return found if len(found) > 1 else set()
    for starter in ("boot.py", "main.py"):
        found |= {n for n in (1, 2) if files.get(starter) == program(n)[f"/{starter}"]}
    return found


@pytest.fixture(scope="module")
def exchange(pico):
    """(flash before, every command of a deploy of version 2 over version 1, what it said)."""
    start = flash_of(pico.flash.content)
    pico.flash.log.clear()
    done = deployed(pico, program(2))
    assert done.error is None and "to be removed: firmware/sub1/b.py" in done.said
    assert "8 files, 7 to copy" in done.text
    assert names(pico.files()) == {*program(2), "/plumb.json", "/config.txt"}
    return start, list(pico.flash.log), done


def states(start, commands):
    """(n, flash, files) after each number of the flash's commands, and in the middle of each."""
    for n, (address, data) in enumerate(commands):
        before = start.piece(address, data)
        ways = list(cuts(before, data, noises()))
        for _, piece in ways[len(ways) // 2 : len(ways) // 2 + 1]:
            start.put(address, piece)
            yield n, read_image(start.content())
            start.put(address, before)
        start.command(address, data)
        yield n + 1, read_image(start.content())


def test_a_cut_at_any_command_of_the_flash_leaves_one_program_or_none(exchange):
    start, commands, _ = exchange
    blocks = dict(start.blocks)
    seen = []
    for n, files in states(start, commands):
        left = versions(files)
        assert left in ({1}, {2}, set()), (n, sorted(files))
        assert files["config.txt"] == b"mine\n"
        if not seen or seen[-1] != left:
            seen.append(left)
    start.blocks = blocks
    print(len(commands), "commands;", seen)
    assert seen == [{1}, set(), {2}]


def boundaries(start, commands):
    """Numbers of commands after which the tree of files has changed."""
    before, found = None, []
    for n, (address, data) in enumerate(commands):
        start.command(address, data)
        tree = sorted(read_image(start.content()))
        if tree != before:
            before = tree
            found.append(n + 1)
    return found


def test_a_board_cut_at_every_file_starts_the_old_program_the_new_one_or_none(exchange, pico):
    start, commands, _ = exchange
    blocks = dict(start.blocks)
    places = boundaries(start, commands)
    started = []
    for n in places:
        start.blocks = dict(blocks)
        for command in commands[:n]:
            start.command(*command)
        board = VirtualPico()
        board.flash.content = start.content()
        with board:
            printed = bytes(board.output).decode()
        found = re.search(r"versions (.*)\r\n", printed)
        if found:
            assert len(set(found.group(1).split())) == 1, printed
            started.append(int(found.group(1)[0]))
        else:
            assert "ImportError: a copy of Plumb was cut short: deploy it again" in printed
            started.append(0)
    start.blocks = blocks
    print(len(places), "boots:", started)
    assert len(places) >= 20
    assert started == sorted(started, key=[1, 0, 2].index) and set(started) == {0, 1, 2}


# ---- each fault in its own words


@pytest.fixture(scope="module")
def old():
    """A board with version 1 as a deploy leaves it."""
    with VirtualPico() as board:
        assert deployed(board, program(1)).error is None
        yield board


def pulled_after(n):
    """Pull the cable after n files."""
    return lambda said: sum(" %  " in line for line in said) >= n


def test_a_pulled_cable_leaves_the_old_program_and_the_next_copy_goes_on(old):
    done = deployed(old, program(2), until=pulled_after(3))
    found = re.search(
        r"the board is gone .*after (\d) of 8 files. Nothing has changed", done.error
    )
    sent = int(found.group(1))
    assert sent >= 3 and "Plug it in" in done.error
    old.reset()
    assert b"versions 1 1 1 1 1 1" in old.output
    done = deployed(old, program(2))
    assert sum(" %  " in line for line in done.said) <= 8 - sent
    assert "versions 2 2 2 2 2 2" in done.said
    assert not [name for name in old.files() if name.startswith("plumb.new")]


def test_a_full_flash_is_told_before_anything_is_written(old):
    files, before = old.files(), old.flash.content
    free = int(old.exec("import os; print(os.statvfs('/')[3])"))
    room = (free - 10) * flash.BLOCK_SIZE
    old.flash.content = flash.image({**files, "big": bytes(room)})
    old.reset()
    done = deployed(old, program(3))
    assert re.search(r"flash is full: \d+ KB are needed, \d+ KB are free. It starts", done.error)
    assert old.files() == {**files, "big": bytes(room)}
    old.flash.content = before
    old.reset()
    assert b"versions 2 2 2 2 2 2" in old.output


def test_a_program_that_fails_is_shown_with_its_traceback(old):
    done = deployed(old, {**program(2), "/main.py": b"import nobody\n"})
    assert "no angle comes. The board says:" in done.error
    assert "ImportError: no module named 'nobody'" in done.error


def test_a_running_watchdog_is_fed(old):
    """Its own program feeds it from a timer, which a soft reset ends."""
    old.exec(
        "import machine\nw = machine.WDT(timeout=1000)\n"
        "t = machine.Timer(-1, period=100, callback=lambda t: w.feed())"
    )
    before = old.restarts
    done = deployed(old, {**program(2), "/firmware/long.py": b"x = 1\n" * 12_000})
    print(f"{done.seconds:.1f} s")
    assert done.seconds > 2 and done.error is None
    assert old.restarts == before + 1  # deploy's own, at the end


def test_the_users_main_stays_through_deploy_and_uninstall():
    mine = "import time\nfrom firmware.app import A\ntime.sleep_ms(400)\nprint('mine', A)\n"
    files = {"main.py": mine, "config.txt": "knobs", "lib/other.py": "", "boot.py": "# nothing\n"}
    with VirtualPico(files=files, mpy=False) as board:
        done = deployed(board, program(1))
        assert done.error is None
        assert "main.py on the board is your own and stays. It starts Plumb with" in done.text
        assert "your main.py has printed:" in done.text and "mine 1" in done.text
        there = board.files()
        assert there["main.py"] == mine.encode()
        assert there["boot.py"] == program(1)["/boot.py"]  # it said nothing
        done = run(board, copy.uninstall)
        assert done.error is None
        assert "removed 7 files; stay: config.txt" in done.text
        assert "main.py on the board is your own and stays" in done.said
        board.run_ms(3000)  # it may have given its prompt already
        assert set(board.files()) == {"main.py", "config.txt", "lib/other.py"}


LATER = b"import time\ntime.sleep_ms(500)\nprint('roll_deg: 0')\n"


def test_the_whole_project_again_without_a_change():
    files = {**flash.compiled(flash.project_files()), "main.py": LATER}
    with VirtualPico(files=files, mpy=False) as board:
        ours = {f"/{name}": content(data) for name, data in files.items()}
        assert "0 to copy" in deployed(board, ours).text  # but the record
        done = deployed(board, ours)
        print(f"{len(files)} files, {done.seconds:.2f} s")
        assert f"{len(files)} files, 0 to copy" in done.text
        assert len(files) > 60 and done.seconds < 5


def content(data):
    return data.read_bytes() if hasattr(data, "read_bytes") else data
