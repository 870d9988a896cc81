# SPDX-License-Identifier: MIT
"""What board code finds on a virtual board: its modules and nothing else, its files, asyncio."""

import sys
import textwrap

import pytest

from tools.virtual.port import Port, install_micropython


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Make a function that runs a source text as a module of board code on a port."""
    monkeypatch.chdir(tmp_path)
    code = tmp_path / "code"
    code.mkdir()
    ports = []

    def run(source, platform="rp2", **settings):
        (code / "boardcode.py").write_text(textwrap.dedent(source))
        port = Port(platform, paths=[code], **settings)
        ports.append(port)
        with port:
            import boardcode
        return boardcode, port

    return run


@pytest.mark.parametrize("name", ["typing", "dataclasses", "numpy", "threading", "contextlib"])
def test_what_only_a_pc_has_cannot_be_imported(board, name):
    with pytest.raises(ImportError, match="on this board"):
        board("import %s" % name)
    module, _ = board("try:\n    import %s\nexcept ImportError:\n    found = False\n" % name)
    assert module.found is False


def test_modules_of_the_board(board):
    module, _ = board(
        """
        import array, binascii, errno, gc, json, machine, math, micropython, os, rp2, struct
        import sys, time, utime, ujson, uos
        same = utime is time and uos is os
        facts = (sys.platform, sys.implementation.name, sys.implementation._machine, sys.maxsize)
        version, wrong = sys.implementation.version, errno.ETIMEDOUT
        free = gc.mem_free() + gc.mem_alloc()
        gc.threshold(1000)
        levels = (hasattr(os, "path"), hasattr(os, "environ"), hasattr(sys, "exc_info"))
        name = os.uname().machine
        """
    )
    assert module.same
    assert module.facts == (
        "rp2", "micropython", "Raspberry Pi Pico with RP2040", 2**31 - 1,
    )  # fmt: skip
    assert module.version[:3] == (1, 25, 0)
    assert module.wrong == 110
    assert module.levels == (False, False, False)
    assert module.name == module.facts[2]
    other, _ = board("import sys, errno, esp32\nfacts = sys.platform, errno.ETIMEDOUT", "esp32")
    assert other.facts == ("esp32", 116)
    with pytest.raises(ImportError):
        board("import rp2", "esp32")


def test_an_os_error_has_its_errno_as_on_the_board(board):
    module, _ = board(
        """
        import micropython
        def plain():
            raise OSError(5)
        @micropython.viper
        def native():
            raise OSError(19)
        found = []
        for f in (plain, native):
            try:
                f()
            except OSError as error:
                found.append((error.errno, error.args[0]))
        """
    )
    assert module.found == [(5, 5), (19, 19)]


def test_files_are_the_boards(board, tmp_path):
    module, _ = board(
        """
        import os
        with open("/a.txt", "w") as file:
            file.write("one")
        with open("b.txt", "w") as file:
            file.write("two")
        os.rename("/b.txt", "/a.txt")
        os.mkdir("/d")
        names = os.listdir("/")
        size = os.stat("a.txt")[6]
        kinds = {entry[0]: entry[1] for entry in os.ilistdir()}
        os.sync()
        try:
            open("/missing")
        except OSError as error:
            missing = error.errno
        """
    )
    assert (tmp_path / "a.txt").read_text() == "two"
    assert module.names == ["a.txt", "code", "d"]
    assert (module.size, module.missing) == (3, 2)
    assert module.kinds["a.txt"] == 0x8000 and module.kinds["d"] == 0x4000


def test_each_port_imports_afresh_and_restores(board):
    first, _ = board("state = []")
    second, _ = board("state = []")
    assert first is not second
    assert "boardcode" not in sys.modules
    assert "machine" not in sys.modules
    assert sys.modules["micropython"] is install_micropython()


def test_asyncio_runs_on_virtual_time(board):
    module, port = board(
        """
        import asyncio
        import machine
        import time

        flag = asyncio.ThreadSafeFlag()
        seen = []

        async def ticks():
            while True:
                await flag.wait()
                seen.append(time.ticks_ms())

        async def main():
            asyncio.create_task(ticks())
            timer = machine.Timer(period=10, callback=lambda timer: flag.set())
            await asyncio.sleep_ms(105)
            timer.deinit()
            await asyncio.sleep(3600)

        asyncio.run(main())
        """
    )
    assert len(module.seen) == 10
    steps = {(b - a) % 2**30 for a, b in zip(module.seen, module.seen[1:])}
    assert steps == {10}
    assert 3600.1e9 < port.now_ns < 3600.2e9


def test_tasks_that_wait_for_ever_are_reported(board):
    with pytest.raises(RuntimeError, match="no event will ever come"):
        board(
            """
            import asyncio
            asyncio.run(asyncio.ThreadSafeFlag().wait())
            """
        )


def test_streams_poll_and_traceback(board, capsys):
    module, _ = board(
        """
        import select, sys
        poll = select.poll()
        poll.register(sys.stdout, select.POLLOUT)
        ready = [bits for _, bits in poll.ipoll(0)]
        sys.stdout.write("line\\n")
        try:
            1 // 0
        except ZeroDivisionError as error:
            sys.print_exception(error)
        """
    )
    assert module.ready == [4]
    out = capsys.readouterr().out
    assert out.startswith("line\n") and "ZeroDivisionError" in out


def test_collecting_garbage_takes_milliseconds(board):
    _, port = board("import gc\ngc.collect()")
    assert 2e6 <= port.now_ns <= 20e6


def test_a_program_and_its_repl(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("import machine\nled = machine.Pin(25, machine.Pin.OUT)\ncount = 1\n")
    with Port("rp2", root=tmp_path) as port:
        names = port.run_file(program)
        port.exec("led.on(); count += 1", names)
        assert port.pin(25).level == 1
        assert names["count"] == 2


def test_wrong_names_are_refused():
    with pytest.raises(ValueError, match="'rp2' or 'esp32'"):
        Port("stm32")
    with pytest.raises(ValueError, match="RP2040, RP2040W, RP2350"):
        Port("rp2", machine_name="ESP32")
