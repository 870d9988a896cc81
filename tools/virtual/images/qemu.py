# SPDX-License-Identifier: MIT
"""Runs a script on the RISC-V MicroPython in QEMU, through the raw REPL on its serial port."""

import subprocess

from tools.virtual.images.workshop import FirmwareError

QEMU = (
    *("qemu-system-riscv32", "-machine", "virt", "-bios", "none", "-display", "none"),
    *("-monitor", "none", "-semihosting", "-serial", "stdio", "-kernel"),
)
CTRL_A, CTRL_D = b"\x01", b"\x04"
PRELUDE = """
import io, sys, vfs
class _Files:
    def __init__(self, files):
        self.files = files
    def mount(self, readonly, mkfs):
        pass
    def umount(self):
        pass
    def chdir(self, path):
        pass
    def getcwd(self):
        return "/"
    def stat(self, path):
        path = path.lstrip("/")
        if path in self.files:
            return (0x8000, 0, 0, 0, 0, 0, len(self.files[path]), 0, 0, 0)
        if any(name.startswith(path + "/") for name in self.files):
            return (0x4000, 0, 0, 0, 0, 0, 0, 0, 0, 0)
        raise OSError(2)
    def open(self, path, mode):
        data = self.files[path.lstrip("/")]
        return io.BytesIO(data) if "b" in mode else io.StringIO(str(data, "utf-8"))
vfs.mount(_Files(%r), "/")
sys.path[:] = ["/"]
"""


def run_script(elf, files, script, timeout_s):
    """What `script` prints, with {path: text or bytes} importable from the root.

    RuntimeError with the traceback when it raises; FirmwareError when it does not end in time.
    """
    contents = {name: _bytes(content) for name, content in files.items()}
    parts = (PRELUDE % contents, script, "import machine; machine.reset()")
    source = CTRL_A + b"".join(part.encode() + CTRL_D for part in parts)
    process = subprocess.Popen([*QEMU, str(elf)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        printed = process.communicate(source, timeout=timeout_s)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        printed = process.communicate()[0]
        raise FirmwareError(f"no end within {timeout_s} s; printed: {printed[-500:]!r}") from None
    answers = printed.split(b">OK")[1:]
    for answer in answers[:2]:
        output, error = answer.split(CTRL_D)[:2]
        if error:
            raise RuntimeError(_text(error))
    return _text(output)


def _bytes(content):
    if hasattr(content, "read_bytes"):
        return content.read_bytes()
    return content.encode() if isinstance(content, str) else bytes(content)


def _text(data):
    return data.decode(errors="replace").replace("\r\n", "\n")
