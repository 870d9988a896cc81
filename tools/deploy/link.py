# SPDX-License-Identifier: MIT
"""The serial line to the board, and every way in which it fails, each in its own words."""

import ast
import contextlib
import errno
import io
import sys
import time
from pathlib import Path

import serial
from mpremote.transport import TransportError
from mpremote.transport_serial import SerialTransport
from serial.tools import list_ports

ON_BOARD = Path(__file__).resolve().parents[1] / "board_scripts" / "deploy.py"
ANSWER_S = 120  # without a byte: a board takes seconds, an emulated one far longer
QUIET_S = 10  # no byte for so long: nobody is there
BACK_S = 10  # within which a board is back on its port after a reset
RIGHTS = {
    "linux": "you may use the port: sudo usermod -aG dialout $USER, then log in anew",
    "darwin": "your terminal may use it (System Settings, Privacy)",
    "win32": "its driver is installed (Device Manager, Ports)",
}
EXAMPLES = {"linux": "/dev/ttyACM0", "darwin": "/dev/cu.usbmodem1101", "win32": "COM5"}


class DeployError(Exception):
    """What went wrong and what to check, in one text."""


class Gone(DeployError):
    """The board stopped answering."""


class Raised(DeployError):
    """What ran on the board raised; its last line, and the whole `traceback`."""

    def __init__(self, traceback):
        super().__init__(traceback.strip().splitlines()[-1])
        self.traceback = traceback


def example():
    """A port's name as this operating system writes it."""
    return EXAMPLES.get(sys.platform, EXAMPLES["linux"])


def ports():
    """The serial ports of this machine that a board can be behind, as a text."""
    found = [port for port in list_ports.comports() if port.vid is not None]
    named = [f"{port.device.replace('/tty.', '/cu.')} ({port.description})" for port in found]
    return ", ".join(sorted(named)) or "none"


class Link:
    """A board with its program stopped. `with Link(port) as board:`; OSErrors become words."""

    def __init__(self, port):
        self.port = port
        self._transport = _opened(port)

    def __enter__(self):
        return self

    def __exit__(self, *exc_info):
        self.close()

    def close(self):
        """Let others have the port."""
        with contextlib.suppress(OSError):  # it went with its cable
            self._transport.close()

    def stop(self):
        """Interrupt the program, keep a watchdog from biting, and begin with an empty heap."""
        script = ON_BOARD.read_text() + "\ndog = watchdog()\nfeed()\n"
        with contextlib.suppress(TransportError, DeployError):  # it prints, or left no heap
            self._enter(soft_reset=False)
            self.run(script)  # before the reset, after which nobody feeds the watchdog
        try:
            self._enter(soft_reset=True)
        except (TransportError, OSError) as error:
            raise DeployError(
                f"{self.port} is there but no MicroPython answers ({error}). Check: MicroPython "
                "is on the board; press RESET; its program does not keep Ctrl-C to itself"
            ) from error
        self.run(script)

    def _enter(self, soft_reset):
        with contextlib.redirect_stdout(io.StringIO()):  # mpremote prints what it cannot read
            self._transport.enter_raw_repl(soft_reset)

    def run(self, source, answer_s=ANSWER_S):
        """What `source` prints. Raised with the board's exception; Gone where it says nothing for
        answer_s."""
        try:
            printed, error = self._transport.exec_raw(source, answer_s)
        except (TransportError, OSError) as failure:
            raise Gone(f"{self.port}: the board is gone ({failure})") from failure
        if error:
            raise Raised(error.decode(errors="replace"))
        return printed.decode()

    def leave(self):
        """End at the friendly REPL, with nothing running; of a board that has gone, nothing."""
        with contextlib.suppress(OSError, TransportError):
            self._transport.serial.write(b"\x03")
            self._transport.exit_raw_repl()

    def ask(self, expression):
        """The value of an expression on the board."""
        return ast.literal_eval(self.run(f"print(repr({expression}))"))

    def reset(self):
        """Restart the board; what it prints can then be listened to."""
        try:
            self._transport.exec_raw_no_follow("import machine; machine.reset()")
        except (TransportError, OSError) as error:
            raise Gone(f"{self.port}: the board is gone ({error})") from error
        time.sleep(0.2)
        self.close()  # or the port would come back under another name
        end = time.monotonic() + BACK_S
        while True:
            try:
                self._transport = _opened(self.port)
                return
            except DeployError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.2)

    def soft_reset(self):
        """Run boot.py and main.py anew without leaving the port."""
        self.send(b"\r\x03\x03\x02\x04")

    def send(self, data):
        try:
            self._transport.serial.write(data)
        except OSError as error:
            raise Gone(f"{self.port}: the board is gone ({error})") from error

    def heard(self):
        """What the board has printed since the last look, bytes."""
        try:
            return self._transport.serial.read(self._transport.serial.in_waiting)
        except OSError as error:
            raise Gone(f"{self.port}: the board is gone ({error})") from error


def _opened(port):
    with contextlib.suppress(TransportError, OSError):
        return SerialTransport(port, timeout=QUIET_S)
    try:  # once more, for the reason, which mpremote keeps to itself
        serial.Serial(port, exclusive=True).close()
    except OSError as error:
        raise DeployError(_why(port, error)) from error
    return SerialTransport(port, timeout=QUIET_S)


def _why(port, error):
    """Busy, forbidden, or not there: what pyserial's and the system's errors mean."""
    text = str(error)
    code = getattr(error, "errno", None)
    if code in (errno.EBUSY, errno.EAGAIN) or "lock" in text or "PermissionError" in text:
        return (
            f"{port} is in use by another program. Close it: Thonny, ViperIDE, a terminal, "
            "a second mpremote"
        )
    if code == errno.EACCES:
        return f"{port} may not be opened ({text}). Check: {RIGHTS.get(sys.platform, '')}"
    return (
        f"no board at {port} (ports here: {ports()}). Check: the cable carries data, not power "
        f"alone; the port's name, as PORT={example()}; {RIGHTS.get(sys.platform, '')}"
    )
