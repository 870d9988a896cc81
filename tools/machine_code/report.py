# SPDX-License-Identifier: MIT
"""The verdicts as tables, and as the JSON file.

`results` is {(arch, version): [Verdict]} everywhere.
"""

import json

from . import compilers
from .processors import ARCHS

_MARKS = {True: "=", False: "WRONG", None: "-"}
_MOST = 4  # faults told of the same compilers on one processor


def _snippet(verdict):
    return verdict.function.startswith("snippets.")


def _columns(results, arch):
    return [version for a, version in results if a == arch]


def matrix(results, arch):
    """Lines: which version compiles what right for a processor.

    A function has a line when some version is wrong and right about others.
    """
    versions = _columns(results, arch)
    if not versions:
        return ["%s (%s): no such compiler" % (arch, ARCHS[arch][0])]
    by_name, lost = {}, set()
    for version in versions:
        verdicts = results[arch, version]
        if not any(v.equal for v in verdicts):
            lost.add(version)  # right about nothing
        for verdict in verdicts:
            by_name.setdefault(verdict.function, {})[version] = verdict.equal
    rows = [("%s: %s" % (arch, ARCHS[arch][0]), versions)]
    for title, mine in (("right, of lib and firmware", False), ("right, of the snippets", True)):
        cells = []
        for version in versions:
            tried = [v for v in results[arch, version] if _snippet(v) == mine]
            tried = [v.equal for v in tried if v.equal is not None]
            cells.append("%d/%d" % (tried.count(True), len(tried)))
        rows.append((title, cells))
    for name, row in by_name.items():
        if any(equal is False and version not in lost for version, equal in row.items()):
            rows.append(("  " + name, [_MARKS[equal] for equal in row.values()]))
    width = max([len(name) for name, _ in rows])
    return [name.ljust(width) + "".join(["%8s" % cell for cell in cells]) for name, cells in rows]


def faults(results):
    """Lines: what is wrong, with the first input that shows it and the instruction."""
    same = {}  # (arch, function, text): versions
    for (arch, version), verdicts in results.items():
        for v in verdicts:
            if v.equal is False:
                same.setdefault((arch, v.function, v.text), []).append(version)
    groups = {}
    for (arch, function, text), versions in same.items():
        groups.setdefault((arch, ", ".join(versions)), []).append((function, text))
    lines = []
    for (arch, versions), wrong in groups.items():
        lines.append("wrong for %s by mpy-cross %s:" % (arch, versions))
        lines += ["  %s: %s" % pair for pair in wrong[:_MOST]]
        if len(wrong) > _MOST:
            lines.append("  and %d more" % (len(wrong) - _MOST))
    return lines


def summary(results):
    """Lines: how much ran, and what did not and why."""
    lines, untried = [], {}
    for (arch, version), verdicts in results.items():
        right = [v for v in verdicts if v.equal]
        for verdict in verdicts:
            if verdict.equal is None:
                untried[verdict.function] = verdict.text
        if version == compilers.PINNED:
            ran, could = [sum(v.coverage[i] for v in right) for i in (0, 1)]
            lines.append(
                "%s %s: %d functions equal in %d calls of %d instructions, %.1f %% of their code"
                % (version, arch, len(right), sum(v.calls for v in right),
                   sum(v.instructions for v in right), 100 * ran / max(could, 1))
            )  # fmt: skip
    return lines + ["not tried: %s: %s" % pair for pair in untried.items()]


def write_json(path, results):
    """rows: equal or not; faults: what is wrong; not_tried: functions, and why."""
    rows, wrong, untried = [], [], {}
    for (arch, version), verdicts in results.items():
        for v in verdicts:
            row = {"arch": arch, "mpy_cross": version, "function": v.function}
            if v.equal is None:
                untried[v.function] = v.text
            else:
                rows.append({**row, "equal": v.equal})
            if v.equal is False:
                wrong.append({**row, "text": v.text})
    with open(path, "w") as file:
        json.dump({"rows": rows, "faults": wrong, "not_tried": untried}, file, indent=1)
        file.write("\n")
