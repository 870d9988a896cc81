# SPDX-License-Identifier: MIT
"""The live page: see a board, tune it, keep what it did."""
