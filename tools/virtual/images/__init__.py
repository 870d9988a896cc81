# SPDX-License-Identifier: MIT
"""How tools.virtual.firmware gets MicroPython's sources and builds images from them."""
