# SPDX-License-Identifier: MIT
"""Every test sees what MicroPython has built in: the `micropython` module and viper's types."""

from tools.virtual.port import install_micropython

install_micropython()
