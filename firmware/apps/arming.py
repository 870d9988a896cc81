# SPDX-License-Identifier: MIT
"""What the applications with motors share: which App, which pins, and when motors may turn."""

from firmware.app import App


def running_app(app):
    """The App given, else the one that runs, else a new one."""
    return app or App.current() or App()


def running(app):
    """The app, whose loop runs from now on."""
    if not app.running:
        app.start()
    return app


def refuse(app, name):
    """ValueError that says why no motor of this application may turn now; nothing when one may."""
    if not app.has(name):
        raise ValueError("not armed: %s was taken away; start() it again" % name)
    if not app.running:
        raise ValueError("not armed: the loop does not run; app.start()")
    if app.stale:
        raise ValueError("not armed: the estimate is stale, %d ms old" % (app.age_us // 1000))
    if app.uncertain:
        raise ValueError(
            "not armed: the estimate is uncertain; hold it still for some seconds, and "
            "app.zero_yaw() where an outage has lost the yaw"
        )
    if app.outputs.raising:
        raise ValueError("not armed: an output raises; see app.outputs.error")
