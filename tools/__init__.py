# SPDX-License-Identifier: MIT
"""What runs on the PC: deploy, bench, accuracy, experiments, demo and the virtual hardware."""
