# SPDX-License-Identifier: MIT
"""Faults in flight: the policy, and how they are mended."""
