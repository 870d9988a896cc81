# SPDX-License-Identifier: MIT
"""Runs first: room for the traceback of an exception in an interrupt, and nothing else."""

import micropython

micropython.alloc_emergency_exception_buf(100)
