# SPDX-License-Identifier: MIT
"""Every fault kind injected at random moments into the real app on the virtual boards."""
