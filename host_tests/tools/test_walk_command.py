# SPDX-License-Identifier: MIT
"""The command as a person calls it: its own processes, which no test has set up."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_command_walks_in_processes_of_its_own():
    command = [sys.executable, "-m", "tools.walk", "--sequences", "20", "--steps", "2"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "20 walks of 2 steps: 0 of 1 parts broke a promise"
