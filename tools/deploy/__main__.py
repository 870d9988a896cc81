# SPDX-License-Identifier: MIT
"""`python -m tools.deploy --port PORT [--source | --mount | --uninstall]`."""

import argparse
import sys

from tools.deploy import copy
from tools.deploy.link import DeployError, example, ports
from tools.deploy.mount import mount


def main():
    """The command; exit code 1 with a text on stderr when something is wrong."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.deploy", description="Copy the project to a board and start it."
    )
    parser.add_argument("--port", help=f"serial port of the board, as {example()}")
    parser.add_argument("--source", action="store_true", help="copy .py files, not .mpy")
    parser.add_argument("--mount", action="store_true", help="run from this PC, copy nothing")
    parser.add_argument("--uninstall", action="store_true", help="remove all but what is yours")
    parser.add_argument(
        "--wait", type=float, default=60, metavar="S", help="for the first line; %(default)s s"
    )
    args = parser.parse_args()
    if not args.port:
        parser.error(
            f"name the board's serial port: make deploy PORT={example()}; here: {ports()}"
        )
    try:
        if args.uninstall:
            copy.uninstall(args.port)
        elif args.mount:
            return mount(args.port)
        else:
            copy.deploy(args.port, args.source, wait_s=args.wait)
    except DeployError as error:
        print(f"deploy: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
