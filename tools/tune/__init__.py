# SPDX-License-Identifier: MIT
"""Settings from recordings: filters against the best hindsight, noise at rest, vibration."""
