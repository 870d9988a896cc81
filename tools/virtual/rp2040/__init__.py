# SPDX-License-Identifier: MIT
"""Parts of the emulated Raspberry Pi Pico: I2C blocks, bit-banged wires, console, flash."""
