# SPDX-License-Identifier: MIT
"""How good the line to a board is: streams from it while knobs are set and read.

    python -m tools.link --port DEV [--samples N] [--knobs N] [--rate HZ] [--json FILE]

Prints samples, losses, damaged frames, and how many knobs were read back as they were set.
"""

import argparse
import json
import sys
import time
from pathlib import Path

from tools.link.board import Board
from tools.link.reader import Reader

SETTLE = 200  # samples before what is counted: start-up, the header


def measured(board, samples, knobs, rate_hz=None):
    """The figures of one run, a dict."""
    if rate_hz:
        board.run(f"app.set('rate_hz', {rate_hz})")
    board.run("app.stream.start(keep_s=100000)")
    reader, good, asked = Reader(), 0, 0
    numbers = []
    while sum(map(len, numbers)) < samples + SETTLE or asked < knobs:
        reader.feed(board.contents())
        numbers += [batch.number for batch in reader.take()]
        had = sum(map(len, numbers)) - SETTLE
        if had > 0 and asked < min(knobs, 1 + had * knobs // samples):
            asked += 1
            value = 0.5 + asked / 100
            board.run(f"app.set('attitude_rest_tau_s', {value})")
            good += abs(float(board.run("print(app.config.attitude_rest_tau_s)")) - value) < 1e-5
    board.run("app.stream.stop()")
    stats = json.loads(board.run("import json\nprint(json.dumps(app.stats().copy()))"))
    return {
        "samples": sum(map(len, numbers)),
        "lost": reader.lost,
        "lost_on_board": reader.counts.ring_lost,
        "bad_frames": board.line.bad,
        "headers": reader.headers,
        "knobs": asked,
        "knobs_good": good,
        "ticks_lost": stats["lost"],
        "tick_errors": stats["errors"],
        "period_us": stats["period_us"],
        "tick": stats["tick"],
        "step_p50_us": stats["step_p50_us"],
        "step_max_us": stats["step_max_us"],
        "late_max_us": stats["late_max_us"],
    }


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.link", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--port", required=True, metavar="DEV")
    parser.add_argument("--samples", type=int, default=500)
    parser.add_argument("--knobs", type=int, default=20)
    parser.add_argument("--rate", type=int, metavar="HZ", help="of the loop; default: as it is")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args(arguments)
    try:
        board = Board(options.port)
        began = time.monotonic()
        row = measured(board, options.samples, options.knobs, options.rate)
        row["seconds"] = round(time.monotonic() - began, 1)
        board.close()
    except OSError as error:
        sys.exit(f"link: {error}")
    print(json.dumps(row, indent=1))
    if options.json:
        options.json.write_text(json.dumps(row, indent=1) + "\n")
    bad = row["lost"] or row["bad_frames"] or row["knobs_good"] < row["knobs"]
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
