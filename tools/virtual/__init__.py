# SPDX-License-Identifier: MIT
"""The virtual hardware: one chip model, plugged into CPython and into an emulated RP2040."""
