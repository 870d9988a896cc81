# SPDX-License-Identifier: MIT
"""A hundred random walks of a user and the world, the same ones each time. More of them:
python -m tools.walk --sequences 2000 --steps 30
"""

from hypothesis import HealthCheck, Phase, settings

from tools.walk.machine import Walk

TestWalk = Walk.TestCase
TestWalk.settings = settings(
    max_examples=100,
    stateful_step_count=12,
    deadline=None,
    derandomize=True,
    database=None,
    phases=(Phase.generate,),
    suppress_health_check=list(HealthCheck),
)
