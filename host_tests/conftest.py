# SPDX-License-Identifier: MIT
"""Every test sees what MicroPython has built in: the `micropython` module and viper's types."""

import gc

from tools.virtual.port import install_micropython

install_micropython()
gc.set_threshold(50_000, 20, 100)  # cycles are few, and looking for them takes time
