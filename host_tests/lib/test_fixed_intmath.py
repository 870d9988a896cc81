# SPDX-License-Identifier: MIT
"""Integer mathematics against the real one, on grids and at random, with the stated errors."""

import math
import random

import pytest
from attitude.fixed import intmath


def wrapped(mdeg):
    return (mdeg + 180000) % 360000 - 180000


def vectors(largest, n=4000):
    rng = random.Random(largest)
    for _ in range(n):
        yield rng.randint(-largest, largest), rng.randint(-largest, largest)


@pytest.mark.parametrize("largest", [3, 60, 4096, 65000])
def test_atan2_stays_within_its_bound(largest):
    for y, x in vectors(largest):
        if x or y:
            error = wrapped(intmath.atan2_mdeg(y, x) - 1000 * math.degrees(math.atan2(y, x)))
            assert abs(error) < 2.5, (y, x)


def test_atan2_at_the_axes_and_the_diagonals_is_exact():
    for size in (1, 2, 77, 16384, 65000):
        for quarter, (y, x) in enumerate([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1)]):
            assert abs(intmath.atan2_mdeg(y * size, x * size) - 45000 * quarter) <= 1
            assert abs(intmath.atan2_mdeg(-y * size, x * size)) == abs(
                intmath.atan2_mdeg(y * size, x * size)
            )
    assert intmath.atan2_mdeg(0, 0) == 0


@pytest.mark.parametrize("largest", [3, 60, 4096, 65000])
def test_hypot_stays_within_its_bound(largest):
    for y, x in vectors(largest):
        true = math.hypot(x, y)
        assert abs(intmath.hypot(x, y) - true) <= 1 + 4e-5 * true, (y, x)
    assert intmath.hypot(0, 0) == 0


def test_isqrt_is_exact():
    rng = random.Random(1)
    roots = [rng.randrange(46341) for _ in range(500)]
    numbers = [*range(300), 2**31 - 1, 2**30, 2**30 - 1]
    for root in roots:
        numbers += [root * root, max(0, root * root - 1), root * root + 2 * root]
    for n in numbers:
        if n < 2**31:
            assert intmath.isqrt(n) == math.isqrt(n)
    assert intmath.isqrt(-5) == 0


def test_long_products():
    rng = random.Random(2)
    for _ in range(3000):
        a, b = rng.randint(-(2**30), 2**30), rng.randint(-(2**15), 2**15)
        assert intmath.mul_q15(a, b) == a * b >> 15


def test_a_ratio_is_the_nearest():
    rng = random.Random(3)
    for _ in range(3000):
        whole = rng.randint(1, 2**21 - 1)
        part = rng.randint(0, min(2**31 - 1, whole * 60000))
        assert abs(intmath.ratio(part, whole) - part * 32768 / whole) <= 0.51
    assert intmath.ratio(64000, 64000) == 32768
    assert intmath.ratio(0, 5) == 0
