# SPDX-License-Identifier: MIT
"""Work for the foreground of a virtual board, while something else is measured in its interrupts.

    with VirtualPico(micropython="1.26.1", ...) as pico:
        pico.exec("...; timer = machine.Timer(freq=1000, hard=True, callback=tick)")
        rounds = under_load(pico, "collecting", 250)
        print(pico.exec("print(results)"))

Each load is what a user's program or a session at the REPL does beside a running loop.
"""

_BODIES = {
    "allocating": """
        values = [0.5 * i for i in range(30)]
        text = "%s" % sum(values)
    """,
    "collecting": """
        values = [0.5 * i for i in range(30)]
        gc.collect()
    """,
}
LOADS = ("idle", *_BODIES, "repl")
# Everything is bound in the function: the table of global names does not grow while it runs.
_LOOP = """
def _load(ms):
    import gc, time
    rounds, begun = 0, time.ticks_ms()
    while time.ticks_diff(time.ticks_ms(), begun) < ms:%s
        rounds += 1
    return rounds
print(_load(%d))
"""
_LINES = (  # what a person, or a tool like mpremote, sends
    "import sys; print(sys.implementation)",
    "names = [name for name in dir()]; print(len(names), names[-3:])",
    "value%d = {n: str(n / 7) for n in range(12)}; print(value%d[3])",
)


def under_load(pico, load, ms):
    """Keep the foreground of a VirtualPico busy for `ms` emulated milliseconds; rounds made.

    `load` is one of LOADS, or the body of a loop as text, indented by eight. What is unfinished
    at the end is finished: the board's prompt is there again.
    """
    if load == "idle":
        pico.run_ms(ms)
        return 0
    if load == "repl":
        return _traffic(pico, ms)
    source = _LOOP % (_BODIES.get(load, load).rstrip(), ms)
    return int(pico.exec(source, timeout_s=ms / 1000 + 5))


def _traffic(pico, ms):
    """Lines at the REPL, one after the other: each is compiled, run and printed on the board."""
    end, rounds = pico.nanos + ms * 1_000_000, 0
    while pico.nanos < end:
        line = _LINES[rounds % len(_LINES)]
        pico.exec(line.replace("%d", str(rounds)))
        rounds += 1
    return rounds
