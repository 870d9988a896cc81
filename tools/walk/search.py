# SPDX-License-Identifier: MIT
"""Looks for a walk that breaks a promise, and writes the shortest down as a test."""

import contextlib
import io


def walked(seed, count, steps):
    """(board, steps, what broke) of the shortest walk that breaks something, or None."""
    from hypothesis import HealthCheck, Phase, settings
    from hypothesis import seed as seeded
    from hypothesis.stateful import run_state_machine_as_test

    from tools.walk.machine import Walk

    chosen = settings(
        max_examples=count, stateful_step_count=steps, deadline=None, database=None,
        suppress_health_check=list(HealthCheck), report_multiple_bugs=False,
        phases=(Phase.generate, Phase.shrink),
    )  # fmt: skip
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            run_state_machine_as_test(seeded(seed)(Walk), settings=chosen)
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and not Walk.last.steps:
            raise
        return Walk.last.board, Walk.last.steps, "%s: %s" % (type(error).__name__, error)
    return None


def as_test(board, steps, what):
    """The walk as a test of host_tests/firmware/test_walked.py."""
    lines = ["def test_NAME(tmp_path):", '    """%s"""' % what.split("\n")[0][:90]]
    lines.append("    steps = [")
    for name, parameters in steps:
        told = {k: v for k, v in parameters.items() if v is not None}
        if name == "set":
            told["value"] = parameters["value"]
        if "how" in parameters and not told.get("how"):
            told.pop("after", None)  # a Ctrl-C's
        lines.append("        (%r, %r)," % (name, told))
    return "\n".join([*lines, "    ]", "    replay(%r, steps, tmp_path)" % board])
