# SPDX-License-Identifier: MIT
"""Small functions, each with one thing in it that a compiler did wrong once, or may.

They run with numbers and buffers of 200 elements at random; what would overflow is left out.
"""

import micropython


@micropython.viper
def constant_index32(p: ptr32, a: int, b: int) -> int:
    """Loads and stores at places that are known, near and far."""
    x = a & 0xFFF
    p[0] = x + 1
    p[3] = b
    p[150] = p[3] ^ x
    return p[0] + (p[150] & 0xFFFF)


@micropython.viper
def constant_index16(p: ptr16, a: int, b: int) -> int:
    x = a & 0xFFF
    p[1] = x
    p[40] = (b & 0x7FFF) ^ p[1]
    p[0] = p[40] >> 1
    return p[0] + p[40] * 2


@micropython.viper
def constant_index8(p: ptr8, a: int, b: int) -> int:
    p[1] = a & 0xFF
    p[180] = (b ^ p[1]) & 0xFF
    p[0] = 7
    return p[180] + p[1] * 256


@micropython.viper
def pointer_further_on(p: ptr32, a: int, b: int) -> int:
    """The same places by a pointer of their own, near and far from it."""
    x = a & 0xFFF
    q = ptr32(int(p) + 400)
    q[0] = x - 7
    q[31] = b
    q[60] = p[100] ^ q[31]
    p[131] = p[160] & 0xFFFF
    return q[31] + (q[0] & 0xFFF)


@micropython.viper
def saturated(a: int, b: int) -> int:
    """By shifts, and by one comparison of what is nearly the magnitude."""
    x = a ^ b >> 3
    if x >> 12 ^ x >> 31:
        x = x >> 31 ^ 4095
    b >>= 1
    if (b ^ b >> 31) > 20000:
        b = 20000 ^ b >> 31
    return x + b


@micropython.viper
def index32_after_load(p: ptr32, i: int) -> int:
    """The index is used again when it has been one: in registers, as the arguments are."""
    i &= 15
    x = p[i] & 0xFFFF
    return i * 65536 + x


@micropython.viper
def index16_after_load(p: ptr16, i: int) -> int:
    i &= 31
    x = p[i]
    return i * 65536 + x + p[i]


@micropython.viper
def index_after_store(p: ptr32, i: int) -> int:
    i &= 31
    p[i] = 5
    p[i + 1] = i
    return i + p[i]


@micropython.viper
def index16_after_store(p: ptr16, i: int) -> int:
    i &= 31
    p[i] = i
    p[2 * i] = 77
    return i


@micropython.viper
def index8_in_a_loop(p: ptr8, n: int) -> int:
    n &= 127
    total = 0
    i = 0
    while i < n:
        p[i] = p[i + 1] ^ i
        total += p[i]
        i += 1
    return total


@micropython.viper
def index_on_the_stack(p: ptr32, q: ptr16, a: int, b: int, c: int) -> int:
    """More locals than registers."""
    i = a & 7
    j = b & 7
    k = i + j
    p[k] = c
    q[j] = k
    p[j] = q[k] + i
    return i + 16 * j + 256 * k + (p[k] & 0xF) + (c & 1)


@micropython.viper
def in_place(p: ptr32, i: int) -> int:
    i &= 15
    p[i] &= 0xFFFF
    p[i] += 3
    p[i] ^= i
    p[5] |= 64
    return p[i] - i


@micropython.viper
def arithmetic(a: int, b: int) -> int:
    x = (a >> 3) - (b >> 4)
    y = (a & 0x7FFF) * (b & 0xFFF) ^ (a >> 1) ^ -1
    return (x >> 2) + (y >> 2) + (0 - (a >> 2))


@micropython.viper
def divisions(a: int, b: int) -> int:
    if b == 0:
        return 0
    return (a >> 1) // b ^ a % b


@micropython.viper
def shifts(a: int, n: int) -> int:
    n &= 31
    return ((a & 1) << n) ^ (a >> n) ^ int(uint(a) >> n)


@micropython.viper
def comparisons(a: int, b: int) -> int:
    x = int(a < b) + 2 * int(a <= b) + 4 * int(a > b) + 8 * int(a >= b) + 16 * int(a == b)
    if a < b and a != 7 or b > 31:
        x += 64
    elif not a >= 0:
        x += 128
    return x


@micropython.viper
def comparisons_unsigned(a: uint, b: uint) -> int:
    x = int(a < b) + 2 * int(a <= b) + 4 * int(a > b) + 8 * int(a >= b)
    if a > b:
        x += 64
    return x + int(a >> 28) * 256


@micropython.viper
def literals(a: int) -> int:
    x = (a & 0xFFFF) * 3 - 1000000
    if x > 40000:
        x -= 65535
    return x ^ -559038737 & 0x3FFFFFF0


@micropython.viper
def loops(n: int, step: int) -> int:
    n &= 31
    total = 0
    for i in range(n):
        if i == 7:
            continue
        total += i * (step & 1023)
    for i in range(20, 0, -3):
        total ^= i
    while n:
        n -= 1
        if n == 2:
            break
        total = (total & 0xFFFFF) * 3 % 1009
    return total


@micropython.viper
def long_loop(p: ptr32, n: int) -> int:
    """A loop of more than 2 KB: its ends are far from each other for a branch."""
    x = n & 0xFF
    i = 0
    while i < 5:
        if p[i] & 1:
            x = (x & 255) * 5 + (p[1] & 15) ^ (x >> 3) + (p[2] & 31) ^ (p[3] & 7) + (x << 2 & 63)
            x = (x & 127) * 7 + (p[4] & 15) ^ (x >> 2) + (p[5] & 31) ^ (p[6] & 7) + (x << 3 & 63)
            x = (x & 255) * 3 + (p[7] & 15) ^ (x >> 5) + (p[8] & 31) ^ (p[9] & 7) + (x << 2 & 63)
            x = (x & 127) * 5 + (p[i] & 15) ^ (x >> 3) + (p[1] & 31) ^ (p[3] & 7) + (x << 1 & 63)
            x = (x & 255) * 7 + (p[3] & 15) ^ (x >> 4) + (p[4] & 31) ^ (p[5] & 7) + (x << 2 & 63)
            x = (x & 127) * 9 + (p[6] & 15) ^ (x >> 1) + (p[7] & 31) ^ (p[i] & 7) + (x << 4 & 63)
            x = (x & 255) * 3 + (p[5] & 15) ^ (x >> 6) + (p[2] & 31) ^ (p[8] & 7) + (x << 1 & 63)
            x = (x & 127) * 7 + (p[1] & 15) ^ (x >> 4) + (p[i] & 31) ^ (p[0] & 7) + (x << 3 & 63)
        else:
            x = (x & 255) * 5 + (p[8] & 15) ^ (x >> 3) + (p[9] & 31) ^ (p[0] & 7) + (x << 2 & 63)
            x = (x & 127) * 3 + (p[1] & 15) ^ (x >> 2) + (p[2] & 31) ^ (p[i] & 7) + (x << 1 & 63)
            x = (x & 255) * 7 + (p[3] & 15) ^ (x >> 4) + (p[4] & 31) ^ (p[5] & 7) + (x << 3 & 63)
            x = (x & 127) * 5 + (p[6] & 15) ^ (x >> 5) + (p[7] & 31) ^ (p[8] & 7) + (x << 2 & 63)
            x = (x & 255) * 9 + (p[9] & 15) ^ (x >> 3) + (p[0] & 31) ^ (p[1] & 7) + (x << 4 & 63)
            x = (x & 127) * 3 + (p[2] & 15) ^ (x >> 2) + (p[3] & 31) ^ (p[i] & 7) + (x << 2 & 63)
            x = (x & 255) * 7 + (p[7] & 15) ^ (x >> 1) + (p[i] & 31) ^ (p[6] & 7) + (x << 1 & 63)
            x = (x & 127) * 5 + (p[9] & 15) ^ (x >> 6) + (p[8] & 31) ^ (p[4] & 7) + (x << 3 & 63)
        i += 1
    return x


@micropython.viper
def objects(a: int, items: object) -> int:
    """Objects, a call, a failure that is caught."""
    n = int(len(items))
    x = int(items[1]) + a % n
    try:
        x += int(shifts(items[0], 3)) & 0xFF
        if x & 1:
            raise OSError(x)
    except OSError:
        x = 0 - (x & 0xFFF)
    return x


@micropython.native
def native(a: int, items: object):
    """Bytecode's meaning in machine code: a loop over a list, a tuple, an exception."""
    total = a
    try:
        for item in items:
            if item == total or item < -40:
                raise OSError(item)
            total = total * 3 - item
    except OSError as error:
        return error.args[0], total
    items[0] = total & 255
    return items[0]
