# SPDX-License-Identifier: MIT
"""The fixed-rate claim: jitter and overruns at 80, 250, 500 and 1000 Hz on the emulated RP2040."""

from tools.experiments import on_board
from tools.experiments.outcome import Outcome, Picture

RATES_HZ = (80, 250, 500, 1000)
TICKS = 150
KEYS = ("ticks", "lost", "overruns", "jitter_p50_us", "jitter_p99_us", "jitter_max_us",
        "step_p50_us", "step_max_us")  # fmt: skip

PROGRAM = """
from firmware.app import App
app = App()
app.set("rate_hz", {rate})
app.start()
time.sleep_ms({ms})
stats = app.stats()
app.stop()
print([stats[k] for k in {keys}])
"""


def run(out, **_):
    """The app with the attitude filter, in the background, at each rate."""
    outcome = Outcome(
        "Fixed rate",
        "Papers 000 (80 Hz or more) and 001, 004 (250 Hz): the period that the board keeps",
    )
    outcome.header = ("rate Hz", *(k.replace("_", " ") for k in KEYS))
    for rate in RATES_HZ:
        with on_board.board(seed=1) as pico:
            ms = 1000 * TICKS // rate
            row = on_board.run(pico, PROGRAM.format(rate=rate, ms=ms, keys=KEYS))
        outcome.rows.append((rate, *row))
    outcome.values = {"rates": {
        str(row[0]): dict(zip(KEYS, row[1:], strict=True)) for row in outcome.rows
    }}  # fmt: skip
    outcome.notes = [
        "jitter: deviation of a period from its nominal length; step: processor time of a tick."
        f" About {TICKS} ticks each, burst in the background, telemetry off the line.",
    ]
    picture = Picture("Jitter of the period", x_label="rate of the loop (Hz)")
    for k, key in enumerate(("jitter_p50_us", "jitter_p99_us", "jitter_max_us")):
        column = KEYS.index(key) + 1
        style = {"marker": "osx"[k], "color": ("#000000", "#666666", "#aaaaaa")[k]}
        picture.line(RATES_HZ, [row[column] for row in outcome.rows], key[7:-3], style)
    picture.axes[0].set_xscale("log")
    picture.axes[0].set_xticks(RATES_HZ, [str(r) for r in RATES_HZ])
    picture.save(outcome, out, "rates", "Jitter on the emulated board", ["jitter (us)"])
    return outcome
