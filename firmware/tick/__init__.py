# SPDX-License-Identifier: MIT
"""What an interrupt runs: account, fetch, judge, update or predict, publish."""
