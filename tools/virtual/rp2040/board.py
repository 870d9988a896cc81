# SPDX-License-Identifier: MIT
"""A virtual Raspberry Pi Pico: the real MicroPython firmware on an emulated RP2040.

    with VirtualPico(bus=Bus(MPU6050Chip()), root=True, main=False) as pico:
        print(pico.exec("import machine; print(machine.I2C(0).scan())"))

Emulated time passes only inside calls, so a run repeats itself to the cycle. Code runs far
slower than on the chip; time that the firmware sleeps through costs next to nothing.
`python -m tools.virtual.pico` serves a board to the real mpremote.
"""

from rp2040py.boards import BoardSpec
from rp2040py.device.base_device import BaseDevice, ResetCause
from rp2040py.execute_batch import execute_batch
from rp2040py.irq import IRQ
from rp2040py.memory_map import FLASH_START_ADDRESS

from tools.virtual import images
from tools.virtual.rp2040 import flash
from tools.virtual.rp2040.console import CTRL_A, CTRL_B, CTRL_C, CTRL_D, RAW_PROMPT, Console
from tools.virtual.rp2040.flash_chip import FlashChip
from tools.virtual.rp2040.i2c_block import I2CBlock
from tools.virtual.rp2040.terminal import Terminal
from tools.virtual.rp2040.wires import Wires

I2C_BASES = (0x40044, 0x40048)  # addresses >> 12
BOOT_S = 15  # emulated seconds within which a board has to give its prompt
PROMPT = b"\r\n>>> "
STACK = 0x20040000  # the end of core 0's, of 8 KB (MicroPython's memmap_mp.ld)
_UNTOUCHED = 0xA55A5AA5


class PicoError(Exception):
    """The board raised an exception (its traceback is the text), or did not answer in time."""


class VirtualPico:
    """One board, switched on by `with`. All times are emulated time.

    `bus` is a tools.virtual.bus.Bus on pins `sda` and `scl` (None: nothing is wired); the devices'
    INT goes to `int_pin`. `files` are {path on the board: bytes, text or Path}; `root` adds the
    project (boot.py, main.py unless `main` is False, lib/, firmware/), modules compiled to .mpy
    when `mpy`. `micropython` is the release to run, one of images.VERSIONS; `image` a UF2 to run
    in its place. `.version` is what the image says of itself.
    """

    def __init__(
        self, bus=None, sda=4, scl=5, int_pin=6, files=None, root=False, main=True, mpy=True,
        image=None, micropython=images.DEFAULT,
    ):  # fmt: skip
        on_flash = dict(files or {})
        if root:
            on_flash = {**flash.project_files(main), **on_flash}
        self.bus = bus
        self.output = bytearray()  # what the board printed and nobody has taken
        self.restarts = 0  # resets by pin, power, watchdog or machine.reset()
        self._raw = False
        self._image = image or images.rp2040_image(micropython)
        self._device = BaseDevice(board=BoardSpec(image=self._image))
        self._simulator = self._device.simulator
        self._mcu = self._device.mcu
        self.flash = FlashChip(self._mcu)
        self.flash.content = flash.image(flash.compiled(on_flash) if mpy else on_flash)
        self._console = self._device.cdc = Console(self._mcu.usb_ctrl)
        self._console.on_serial_data = self._on_output
        self._console.on_device_connected = lambda: self._console.send(b"\r\n")
        self._console.on_restart = self._restarted
        self._until = None
        self._alarm = self._simulator.clock.create_alarm(self._pause)
        self._wire(bus, sda, scl, int_pin)

    def _wire(self, bus, sda, scl, int_pin):
        self._wires = None if bus is None else Wires(self._mcu, bus, sda, scl, int_pin)
        for index, (base, irq) in enumerate(zip(I2C_BASES, (IRQ.I2C0, IRQ.I2C1), strict=True)):
            block = I2CBlock(self._mcu, index, irq)
            block.wires = self._wires
            self._mcu.i2c[index] = self._mcu.peripherals[base] = block

    def __enter__(self):
        self.boot()
        return self

    def __exit__(self, *exc_info):
        self._simulator.stop()

    # time

    @property
    def nanos(self):
        """Emulated time since power-on, ns."""
        return self._simulator.clock.nanos

    def run_ms(self, ms):
        """Let time pass; the text that the board printed meanwhile."""
        self.output.clear()
        self._run(None, ms / 1000)
        return _text(self.output)

    def _run(self, until, timeout_s):
        """Run until `until()` is true after some output, or for `timeout_s`; False when late."""
        if until is not None and until():
            return True
        if self._wires is not None:
            self._wires.schedule()  # somebody may have given the bus a fault
        deadline = self.nanos + timeout_s * 1e9
        self._alarm.schedule(timeout_s * 1e9)
        self._until = until
        done = False
        while not done and self.nanos < deadline:
            self._simulator.stopped = False
            execute_batch(self._simulator, 1)
            done = until is not None and until()
        self._until = None
        self._alarm.cancel()
        return done

    def _pause(self):
        self._simulator.stopped = True

    def _restarted(self):
        self.restarts += 1
        self._raw = False
        self._pause()

    def _on_output(self, data):
        self.output += data
        if self._until is not None and self._until():
            self._pause()

    @property
    def version(self):
        """(major, minor, micro) of the board's MicroPython."""
        return images.image_version(self._image)

    # the board's life

    def boot(self, timeout_s=BOOT_S):
        """Switch on and wait for the REPL's prompt (so for the end of main.py)."""
        self._mcu.core.pc = FLASH_START_ADDRESS
        self.wait_prompt(timeout_s)

    def boot_until(self, pattern, timeout_s=BOOT_S):
        """Switch on, type nothing, and wait until the board prints what `pattern` finds (a
        compiled one, of bytes); milliseconds since power-on. PicoError when it does not.
        """
        self._console.on_device_connected = lambda: None
        self._mcu.core.pc = FLASH_START_ADDRESS
        if not self._run(lambda: pattern.search(self.output), timeout_s):
            raise PicoError(f"not within {timeout_s} s; printed: {_text(self.output)}")
        return self.nanos / 1e6

    def reset(self, timeout_s=BOOT_S):
        """Press RESET: RAM and peripherals start anew, flash stays; main.py runs again."""
        self._device.hard_reset(cause=ResetCause.RUN_PIN)
        self.wait_prompt(timeout_s)

    def power_cycle(self, timeout_s=BOOT_S):
        """Cut the power of board and sensor, and switch it on again; flash stays as it was."""
        for device in self.bus.devices if self.bus else ():
            device.power_off()
            device.power_on()
        self._device.hard_reset(cause=ResetCause.POWER_ON)
        self.wait_prompt(timeout_s)

    def wait_prompt(self, timeout_s=BOOT_S):
        """Wait for the REPL's prompt, after a restart that the board made by itself."""
        self.output.clear()
        self._raw = False
        if not self._run(lambda: self.output.endswith(PROMPT), timeout_s):
            raise PicoError(f"no prompt within {timeout_s} s; printed: {_text(self.output)}")

    def files(self):
        """{path: bytes} of the files on the board's flash at this moment."""
        return flash.read_image(self.flash.content)

    # memory

    def word(self, address):
        """The 32 bits there."""
        return self._mcu.read_uint32(address)

    def mark_stack(self):
        """Fill what is free of it, so that stack_left() sees how far it was ever used."""
        for address in range(STACK, self._mcu.core.registers[13] - 64, 4):
            self._mcu.write_uint32(address, _UNTOUCHED)

    def stack_left(self):
        """Bytes at its end that nothing has touched since mark_stack(); 0: beyond it, too."""
        left = 0
        while self.word(STACK + left) == _UNTOUCHED:
            left += 4
        return left

    # the REPL

    def exec(self, source, timeout_s=20, ctrl_c_ms=()):
        """Run `source` at the raw REPL; what it printed. PicoError with the board's traceback.

        Background timers go on; a program in the foreground is interrupted first. ctrl_c_ms:
        Ctrl-C is pressed after so many milliseconds, and so many more.
        """
        if not self._raw:
            self._console.send(b"\r" + CTRL_C + CTRL_C + CTRL_A)
            self._expect(RAW_PROMPT, BOOT_S)
            self._raw = True
        self.output.clear()
        self._console.send(source.encode() + CTRL_D)
        self._expect(b"OK", timeout_s)
        for ms in ctrl_c_ms:
            self._run(None, ms / 1000)
            self._console.send(CTRL_C)
        printed = self._expect(CTRL_D, timeout_s)
        error = self._expect(CTRL_D, timeout_s)
        self._expect(b">", timeout_s)
        if error:
            raise PicoError(_text(error))
        return _text(printed)

    def _expect(self, mark, timeout_s):
        """Output up to `mark`, which is dropped with it."""
        restarts = self.restarts
        if not self._run(lambda: mark in self.output or self.restarts > restarts, timeout_s):
            self._raw = False
            raise PicoError(f"no answer within {timeout_s} s; printed: {_text(self.output)}")
        if self.restarts > restarts:
            raise PicoError("the board restarted; wait_prompt() waits until it is up again")
        before, _, after = bytes(self.output).partition(mark)
        self.output[:] = after
        return before

    def soft_reset(self):
        """A soft reset from the raw REPL, as mpremote makes it: main.py does not run."""
        self.exec("pass")
        self.output.clear()
        self._console.send(CTRL_D)
        self._expect(RAW_PROMPT, BOOT_S)

    def leave_raw(self):
        """Back to the friendly REPL, as a person at a terminal sees it."""
        if self._raw:
            self._console.send(CTRL_B)
            self.wait_prompt(BOOT_S)

    # other programs

    def terminal(self):
        """A pseudo-terminal for other programs: `with pico.terminal() as port:`, port.path."""
        self.leave_raw()
        return Terminal(self._console, self._run)

    def mpremote(self, *arguments, timeout_s=120):
        """Run the real mpremote on this board (for `timeout_s` of real time): what it printed."""
        with self.terminal() as port:
            code, printed = port.mpremote(arguments, timeout_s)
        if code:
            raise PicoError(f"mpremote {' '.join(arguments)}: {_text(printed)}")
        return _text(printed)


def _text(data):
    return bytes(data).decode(errors="replace").replace("\r\n", "\n")
