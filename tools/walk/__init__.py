# SPDX-License-Identifier: MIT
"""A random user and a random world on the virtual boards: verbs of the REPL, knobs, applications,
faults, pauses, power cuts and motion in any order; after each step what the project promises is
checked (tools.walk.checks).

    python -m tools.walk --sequences 2000 --steps 30 [--seed N]
"""
