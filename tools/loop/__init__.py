# SPDX-License-Identifier: MIT
"""The loop under load, on the emulated RP2040 with the real MicroPython."""
