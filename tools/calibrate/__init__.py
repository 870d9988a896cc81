# SPDX-License-Identifier: MIT
"""Calibrates a sensor pose by pose, a real board's or a virtual one's."""
