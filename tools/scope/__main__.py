# SPDX-License-Identifier: MIT
"""The live page: traces, knobs, the past tuned anew, vibration, steps.

    python -m tools.scope [--port DEV | --virtual | --file REC] [--http-port N] [--no-browser]

It answers on 127.0.0.1 only, to this machine's browser and to no other site's page.
"""

import argparse
import contextlib
import sys
from pathlib import Path

from tools.link import desk

HTTP_PORT = 8137


def serve(session, http_port, show):
    """The page, until Ctrl-C."""
    from nicegui import app, ui

    from tools.scope import assets
    from tools.scope.guard import Guard
    from tools.scope.page import View

    folder = assets.uplot()
    if folder is None:
        print("npm is not there, so uPlot is not: a slower chart", file=sys.stderr)
    else:
        app.add_static_files("/uplot", folder)
        ui.add_head_html(
            '<script src="/uplot/uPlot.iife.min.js"></script>'
            '<link rel="stylesheet" href="/uplot/uPlot.min.css">',
            shared=True,
        )
    app.add_middleware(Guard, port=http_port)

    @ui.page("/", title="Plumb")
    def index():
        View(session)

    app.on_startup(lambda: print(f"page: http://127.0.0.1:{http_port}/", flush=True))
    app.on_shutdown(session.close)
    ui.run(
        host="127.0.0.1", port=http_port, reload=False, show=show, show_welcome_message=False,
        message_history_length=100, favicon="📐",
    )  # fmt: skip


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.scope", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    which = desk.options(parser)
    which.add_argument("--file", type=Path, metavar="REC", help="a recording in the board's place")
    parser.add_argument("--http-port", type=int, default=HTTP_PORT, metavar="N")
    parser.add_argument("--no-browser", action="store_true")
    options = parser.parse_args(arguments)
    from tools.scope.session import Session

    with contextlib.ExitStack() as stack:
        if options.file:
            from tools.track import load

            try:
                session = Session(track=load(options.file))
            except (OSError, ValueError) as error:
                sys.exit(f"scope: {error}")
        elif options.virtual:
            board = stack.enter_context(desk.VirtualBoard(options.motion))
            session = Session(board.port, virtual=board)
        else:
            session = Session(stack.enter_context(desk.board(options)))
        serve(session, options.http_port, not options.no_browser)


if __name__ == "__main__":
    main()
