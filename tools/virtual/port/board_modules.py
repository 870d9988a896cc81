# SPDX-License-Identifier: MIT
"""The standard modules as a board has them: sys, os, gc, select, errno, with what CPython has more
left out.
"""

import errno as host_errno
import os as host_os
import sys as host_sys
import traceback
import types

from .traits import RV32IMC

_HEAP_BYTES = {"rp2": 230_000, "esp32": 110_000}
_ERRORS = """
EPERM ENOENT EIO EBADF EAGAIN ENOMEM EACCES EEXIST ENODEV EISDIR EINVAL EOPNOTSUPP EADDRINUSE
ECONNABORTED ECONNRESET ENOBUFS ENOTCONN ETIMEDOUT ECONNREFUSED EHOSTUNREACH EALREADY EINPROGRESS
"""
_SYS_NAMES = ("path", "modules", "argv")


def _module(name, **names):
    module = types.ModuleType(name, "MicroPython's %s." % name)
    vars(module).update(names)
    return module


class _Output:
    """A stream that the host has at this moment; a hard callback may not write to it."""

    def __init__(self, port, find):
        self._port, self._find = port, find

    def __getattr__(self, name):
        return getattr(self._find(), name)

    @property
    def buffer(self):
        return _Output(self._port, lambda: self._find().buffer)

    def write(self, data):
        self._port.hard.refuse("print")
        self._port.console.write(len(data))
        return self._find().write(data)


class _Sys(types.ModuleType):
    """Streams and the module table are the host's of this moment, so that captured output is
    captured.
    """

    def __getattr__(self, name):
        if name in _SYS_NAMES:
            return getattr(host_sys, name)
        raise AttributeError("module 'sys' has no attribute %r" % name)


def _mpy(port):
    """Version 6.3 of .mpy files and, where the port loads native ones, the processor's code."""
    native = port.traits.native
    return 0x306 | (native << 10 if native != RV32IMC or port.version >= (1, 24) else 0)


class _Input:
    """The board's sys.stdin: what somebody typed into `port.stdin`."""

    def __init__(self, port):
        self._port = port

    def read(self, count=-1, /):
        port = self._port
        end = len(port.stdin) if count < 0 else count
        text, port.stdin = port.stdin[:end], port.stdin[end:]
        return text


def make_sys(port):
    module = _Sys("sys", "MicroPython's sys.")
    module.platform, module.byteorder, module.maxsize = port.traits.platform, "little", 0x7FFFFFFF
    module.version = "3.4.0; MicroPython v%d.%d.%d" % port.version
    module.version_info = (3, 4, 0)
    module.implementation = types.SimpleNamespace(
        name="micropython", version=(*port.version, ""),
        _machine=port.traits.machine_text(port.version), _mpy=_mpy(port), _build=port.traits.build,
    )  # fmt: skip
    module.stdin = _Input(port)
    module.stdout = _Output(port, lambda: host_sys.stdout)
    module.stderr = _Output(port, lambda: host_sys.stderr)

    def print_exception(error, file=module.stdout, /):
        traceback.print_exception(error, file=file)

    module.print_exception = print_exception
    module.exit = host_sys.exit
    return module


def _uname(port):
    release = "%d.%d.%d" % port.version
    fields = {
        "sysname": port.traits.platform, "nodename": port.traits.platform, "release": release,
        "version": "v%s" % release, "machine": port.traits.machine_text(port.version),
    }  # fmt: skip
    return types.SimpleNamespace(**fields)


def make_os(port):
    """`os` on the board's file system: the root is `port.root`, which is the current directory."""
    path = port.path

    def ilistdir(directory="", /):
        for entry in host_os.scandir(path(directory)):
            folder = entry.is_dir()
            size = 0 if folder else entry.stat().st_size
            yield entry.name, 0x4000 if folder else 0x8000, 0, size

    def listdir(directory="", /):
        return sorted(host_os.listdir(path(directory)))

    def stat(name, /):
        values = host_os.stat(path(name))
        return (values.st_mode & 0xF000, 0, 0, 0, 0, 0, values.st_size, 0, 0, 0)

    def rename(old, new, /):
        host_os.replace(path(old), path(new))

    terminal = None

    def dupterm(stream, index=0, /):
        nonlocal terminal
        before, terminal = terminal, stream
        return before

    def dupterm_notify(_, /):
        key = bytearray(1)
        while terminal is not None and terminal.readinto(key):
            if key == b"\x03":
                port.clock.scheduler.pressed = True
                return

    return _module(
        "os",
        ilistdir=ilistdir, listdir=listdir, stat=stat, rename=rename,
        remove=lambda name, /: host_os.remove(path(name)),
        unlink=lambda name, /: host_os.remove(path(name)),
        mkdir=lambda name, /: host_os.mkdir(path(name)),
        rmdir=lambda name, /: host_os.rmdir(path(name)),
        getcwd=lambda: "/", sync=lambda: None, urandom=host_os.urandom,
        statvfs=lambda name, /: (4096, 4096, 352, 300, 300, 0, 0, 0, 0, 255),
        uname=lambda: _uname(port), dupterm=dupterm, dupterm_notify=dupterm_notify,
    )  # fmt: skip


def make_gc(port):
    """`gc`: a collection takes `port.gc_ns`, in which soft callbacks wait and hard ones run. The
    figures are fixed ones of a board of this kind.
    """
    size = _HEAP_BYTES[port.traits.platform]
    state = {"threshold": -1, "enabled": True}

    def threshold(*amount):
        if not amount:
            return state["threshold"]
        state["threshold"] = amount[0]
        return None

    def guarded(name, function):
        def call(*arguments):
            port.hard.refuse("gc.%s" % name)
            return function(*arguments)

        return call

    functions = {
        "collect": lambda: port.clock.busy(port.gc_ns), "threshold": threshold,
        "mem_free": lambda: size * 3 // 4, "mem_alloc": lambda: size // 4,
        "enable": lambda: state.update(enabled=True),
        "disable": lambda: state.update(enabled=False),
        "isenabled": lambda: state["enabled"],
    }  # fmt: skip
    return _module("gc", **{name: guarded(name, f) for name, f in functions.items()})


class Poll:
    """`select.poll()` for the standard streams: output as port.console says, input when
    `port.stdin` holds something.
    """

    def __init__(self, port):
        self._port, self._streams = port, []

    def register(self, stream, events=5, /):
        self._streams = [entry for entry in self._streams if entry[0] is not stream] + [
            (stream, events)
        ]

    modify = register

    def unregister(self, stream, /):
        self._streams = [entry for entry in self._streams if entry[0] is not stream]

    def _ready(self):
        found = []
        for stream, events in self._streams:
            writable = not isinstance(stream, _Input) and self._port.console.ready()
            bits = events & (4 if writable else 0)
            if isinstance(stream, _Input) and self._port.stdin:
                bits |= events & 1
            if bits:
                found.append((stream, bits))
        return found

    def poll(self, timeout=-1, flags=0, /):
        ready = self._ready()
        if not ready and timeout > 0:
            self._port.clock.sleep(timeout * 1_000_000)
            ready = self._ready()
        return ready

    def ipoll(self, timeout=-1, flags=0, /):
        return iter(self.poll(timeout, flags))


def _make_esp32(port):
    """ports/esp32/modesp32.c: its two ways to be woken by pins, where the chip has them."""

    def wake(pins, level):
        for pin in pins:
            number = port.pins.number(pin)
            if number not in port.traits.wake_pins:
                raise ValueError("invalid pin")
            port.wake_levels[number] = int(level)

    module = _module(
        "esp32", mcu_temperature=lambda: 40, idf_heap_info=lambda cap: [],
        WAKEUP_ALL_LOW=False, WAKEUP_ANY_HIGH=True,
    )  # fmt: skip
    if port.traits.wake_by == "ext0":
        module.wake_on_ext0 = lambda pin, level: wake([pin], level)
    if port.traits.wake_by == "ext1":
        module.wake_on_ext1 = wake
    return module


def make_modules(port):
    """Return {name: module} of the standard modules that differ."""
    errors = {name: getattr(host_errno, name) for name in _ERRORS.split()}
    errors["ETIMEDOUT"] = port.traits.etimedout
    poll = type("poll", (Poll,), {"__init__": lambda self: Poll.__init__(self, port)})
    return {
        "sys": make_sys(port),
        "os": make_os(port),
        "gc": make_gc(port),
        "errno": _module("errno", errorcode={v: k for k, v in errors.items()}, **errors),
        "select": _module("select", poll=poll, POLLIN=1, POLLOUT=4, POLLERR=8, POLLHUP=16),
        "rp2": _module("rp2", bootsel_button=lambda: 0, PIO=None, Flash=None),
        "esp32": _make_esp32(port),
    }
