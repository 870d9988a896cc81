# SPDX-License-Identifier: MIT
"""Starts the application in the background and prints angles until a key is pressed.

Then the REPL has the line, with `app` and `imu` to look at and change while the loop runs on:
app.stats(), app.set("filter", "kalman2"), app.watch(). A failure shows one traceback and the REPL.
"""

import sys

try:
    from firmware.app import App

    app = App()
    app.start()
    imu = app.imu
    app.watch()
except Exception as error:
    sys.print_exception(error)
