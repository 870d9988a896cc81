# SPDX-License-Identifier: MIT
"""From angles to actuators: PID, servo, ESCs, mixer; integer twins in control.fixed.

As in `attitude`, a name is loaded from its own file when it is first asked for.
"""

_HOME = {
    "PID": "pid",
    "VelocityPID": "pid",
    "Servo": "servo",
    "Escs": "esc",
    "HBridge": "hbridge",
    "QuadX": "mixer",
}


def __getattr__(name):
    if name == "fixed":  # MicroPython looks for a submodule only where there is no __getattr__
        return __import__("control.fixed", None, None, (name,))
    home = _HOME.get(name)
    if home is None:
        raise AttributeError("control has no %s" % name)
    value = getattr(__import__("control." + home, None, None, (name,)), name)
    globals()[name] = value
    return value
