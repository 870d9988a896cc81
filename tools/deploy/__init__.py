# SPDX-License-Identifier: MIT
"""Copies the project to a board with mpremote, whole or not at all, and starts it.

    make deploy PORT=/dev/ttyACM0         (COM5 on Windows, /dev/cu.usbmodem1101 on macOS)

Only what differs is copied, compared by digests that the board makes. Modules go as .mpy, compiled
for the processor that the board names. A boot.py or main.py of the user's own stays. Until the
last file has arrived the board has its old program; then the new one takes its place
(tools/board_scripts/deploy.py). Afterwards the first angle, or what the board says, is shown.
"""
