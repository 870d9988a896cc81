# SPDX-License-Identifier: MIT
"""What runs on the PC: deploy, bench, accuracy, experiments, demo and the virtual hardware."""

import sys
from pathlib import Path

# the board's libraries, imported as the board imports them; also in processes that tools start
_LIB = str(Path(__file__).resolve().parent.parent / "lib")
if _LIB not in sys.path:
    sys.path.insert(0, _LIB)
