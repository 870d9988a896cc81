# SPDX-License-Identifier: MIT
"""Simulated plants: physics that the board's PWM outputs move and the virtual sensor feels.

A plant is a motion source (tools.virtual.motion). The chip asks it for the state at each of its
samples; it integrates up to there with the pulses that the board has written by then.
"""
