# SPDX-License-Identifier: MIT
"""Integer mathematics for the boards: 32 bits, no floats, no allocation, stated errors.

Fixed-point notation: Qn is a number times 2^n. Every function is viper code and loops nowhere
on its data's account. A call from Python costs some 10 us on an RP2040, so the filters carry
these formulas inside their own function and test_fixed_intmath.py holds them equal.
All results are within MicroPython's 31-bit small integers unless the text says otherwise.
"""

import micropython


@micropython.viper
def atan2_mdeg(y: int, x: int) -> int:
    """Angle of the vector (x, y) in millidegrees within +-180000; 0 for the zero vector.

    |x|, |y| up to 65000. Error below 2.5 millidegrees, of which the 15-bit ratio makes 0.9: the
    quotient t of the smaller by the larger is Q15, and atan(t) = t (57288 + r) millidegrees,
    r a polynomial in t^2 in quarters of a millidegree (minimax, 0.66 at worst; own fit).
    """
    a = y if y >= 0 else 0 - y
    b = x if x >= 0 else 0 - x
    steep = a > b
    if steep:
        t = b
        b = a
        a = t
    if b == 0:
        return 0
    t = ((a << 15) + (b >> 1)) // b
    u = (t * t) >> 15
    r = 4777 * u >> 15
    r = (r - 19516) * u >> 15
    r = (r + 41289) * u >> 15
    r = (r - 75700) * u + 16384 >> 15
    m = (t * 57288 + (t * r >> 2) + 16384) >> 15
    if steep:
        m = 90000 - m
    if x < 0:
        m = 180000 - m
    if y < 0:
        m = 0 - m
    return m


@micropython.viper
def hypot(x: int, y: int) -> int:
    """sqrt(x^2 + y^2), |x|, |y| up to 65000; error below 4e-5 of the result plus 1.

    The larger times sqrt(1 + t^2) - 1, a Q16 polynomial in t^2 (minimax, own fit).
    """
    a = y if y >= 0 else 0 - y
    b = x if x >= 0 else 0 - x
    if a > b:
        t = b
        b = a
        a = t
    if b == 0:
        return 0
    t = ((a << 15) + (b >> 1)) // b
    u = (t * t) >> 15
    r = 726 * u >> 15
    r = (3039 - r) * u >> 15
    r = (r - 7911) * u >> 15
    r = (r + 32744) * u + 16384 >> 15
    return b + ((b * r + 32768) >> 16)


@micropython.viper
def isqrt(n: int) -> int:
    """Whole part of the square root of 0 <= n < 2^31, exact; 0 for a negative n."""
    if n < 0:
        return 0
    root = 0
    bit = 1 << 28
    bit <<= 2  # 2^30 is no small integer, so no constant
    while bit > n:
        bit >>= 2
    while bit:
        if n >= root + bit:
            n -= root + bit
            root = (root >> 1) + bit
        else:
            root >>= 1
        bit >>= 2
    return root


@micropython.viper
def mul_q15(a: int, b: int) -> int:
    """a b / 2^15 rounded down, for any 31-bit a and |b| up to 2^15, without a 64-bit product.

    Exact. The result must fit 31 bits.
    """
    return (a >> 15) * b + ((a & 0x7FFF) * b >> 15)


@micropython.viper
def ratio(part: int, whole: int) -> int:
    """part / whole, Q15, to the nearest; 0 <= part < 2^16 whole, 0 < whole < 2^21."""
    rest = (part % whole) << 9
    q = (part // whole << 15) + (rest // whole << 6)
    return q + ((rest % whole << 6) + (whole >> 1)) // whole
