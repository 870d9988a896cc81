# SPDX-License-Identifier: MIT
"""Tilt error of every filter on recordings with optical truth."""
