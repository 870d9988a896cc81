# SPDX-License-Identifier: MIT
"""Integer twins of the controllers: the same verbs, no allocation in update()."""

from control.fixed.cascade import Cascade
from control.fixed.mixer import QuadX
from control.fixed.pid import PID

__all__ = ("PID", "Cascade", "QuadX")
