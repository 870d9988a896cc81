# SPDX-License-Identifier: MIT
"""The main job without hardware: run it, estimate beside it, tell and draw."""
