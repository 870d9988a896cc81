# SPDX-License-Identifier: MIT
"""The board's own filters over a recording, with other settings, as fast as a PC can."""
