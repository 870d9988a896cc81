# SPDX-License-Identifier: MIT
"""What is counted: app.stats() at the REPL and in programs."""

from micropython import const

from firmware.faults.policy import POLICY
from firmware.tick import judge

# places: firmware.tick.words
_PREDICTED = const(4)
_ERRORS = const(20)
_BUSY = const(23)
_COUNT = const(30)


def faults(app):
    """{cause: how often} of those seen since the start (firmware.faults.policy)."""
    words, out = app.tick.words, {}
    for code in range(1, len(POLICY)):
        if words[_COUNT + code]:
            out[POLICY[code].cause] = words[_COUNT + code]
    over = judge.accel_saturated(app.tick.memory)
    if over:
        out["accel_saturated"] = over
    return out


class Stats(dict):
    """A dict that prints a group a line."""

    _GROUPS = ("period", "jitter", "late", "step", "output", "telemetry")

    def __repr__(self):
        rows, names = [], sorted(self)
        for group in ("",) + self._GROUPS:
            row = []
            for name in names:
                if group == self._of(name):
                    row.append("%r: %r" % (name, self[name]))
            if row:
                rows.append(", ".join(row))
        return "{%s}" % ",\n ".join(rows)

    def _of(self, name):  # split() would make a heap full of pieces
        for group in self._GROUPS:
            if name.startswith(group):
                return group
        return ""


def stats(app):
    """Timing (firmware.loop), faults by cause, outputs and telemetry, as a dict."""
    out = Stats(app.loop.stats() if app.loop else {})
    out.update(faults(app))
    words = app.tick.words
    out["tick"] = app.tick_kind
    out["predicted"] = words[_PREDICTED]
    out["busy"] = words[_BUSY]
    out["errors"] = words[_ERRORS] + app.foreground.errors
    out["age_ms"] = app.age_us // 1000
    out["stale"] = app.stale
    out["uncertain"] = app.uncertain
    out["output_errors"] = app.outputs.failed
    out["output_late"] = app.outputs.late
    out["telemetry_lines"] = app.telemetry.lines
    out["telemetry_dropped"] = app.telemetry.dropped
    out["telemetry_stalls"] = app.telemetry.stalls
    return out
