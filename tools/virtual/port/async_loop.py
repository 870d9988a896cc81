# SPDX-License-Identifier: MIT
"""`asyncio` of a board on the virtual clock: waiting lets virtual time pass, and MicroPython's
additions are there.
"""

import asyncio
import selectors
import types


class _ClockSelector(selectors.BaseSelector):
    """Waits by letting virtual time pass up to the next event."""

    def __init__(self, clock):
        self._clock, self._keys = clock, {}

    def register(self, fileobj, events, data=None):
        key = self._keys[fileobj] = selectors.SelectorKey(fileobj, 0, events, data)
        return key

    def unregister(self, fileobj):
        return self._keys.pop(fileobj)

    def get_map(self):
        return self._keys

    def select(self, timeout=None):
        clock = self._clock
        clock.breathe()
        if timeout is not None and timeout <= 0:
            return []
        event_ns = clock.next_event_ns()
        if timeout is None and event_ns is None:
            raise RuntimeError("every task waits and no event will ever come")
        deadline_ns = None if timeout is None else clock.now_ns + max(1, round(timeout * 1e9))
        soonest = min(t for t in (deadline_ns, event_ns) if t is not None)
        clock.sleep_until(max(soonest, clock.now_ns + 1))
        return []


class ThreadSafeFlag:
    """MicroPython's flag that an interrupt may set; one task waits for it, waiting clears it."""

    def __init__(self):
        self._set, self._waiter = False, None

    def set(self):
        self._set = True
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def clear(self):
        self._set = False

    async def wait(self):
        if not self._set:
            self._waiter = asyncio.get_running_loop().create_future()
            await self._waiter
        self._set = False


async def sleep_ms(ms):
    await asyncio.sleep(ms / 1000)


async def wait_for_ms(awaitable, timeout_ms):
    return await asyncio.wait_for(awaitable, timeout_ms / 1000)


def make_module(clock):
    """Return an `asyncio` with what MicroPython has in it."""

    class Loop(asyncio.SelectorEventLoop):
        def __init__(self):
            super().__init__(_ClockSelector(clock))
            self._clock_resolution = 1e-9

        def time(self):
            return clock.now_ns / 1e9

    def run(coroutine):
        loop = Loop()
        try:
            return loop.run_until_complete(coroutine)
        finally:
            for task in asyncio.all_tasks(loop):
                task.cancel()
            loop.close()

    module = types.ModuleType("asyncio", "MicroPython's asyncio on the virtual clock.")
    for name in (
        "sleep",
        "gather",
        "create_task",
        "current_task",
        "Event",
        "Lock",
        "CancelledError",
        "TimeoutError",
    ):
        setattr(module, name, getattr(asyncio, name))
    module.wait_for, module.wait_for_ms, module.sleep_ms = asyncio.wait_for, wait_for_ms, sleep_ms
    module.ThreadSafeFlag, module.run = ThreadSafeFlag, run
    module.get_event_loop = lambda: types.SimpleNamespace(create_task=asyncio.create_task)
    module.new_event_loop = lambda: None
    return module
