# SPDX-License-Identifier: MIT
"""Taking over a chip that measures already, without a reset: after the board's own, in flight."""

from micropython import const

_INT_PIN_CFG = const(0x37)
_INT_ENABLE = const(0x38)
_PWR_MGMT_1 = const(0x6B)
_PWR_MGMT_2 = const(0x6C)


def attach_to(device):
    """Write those rows of the driver's table that differ; True when the gyro had to be started.

    The interrupts stay as they are, and what they are is the table's from now on. OSError.
    """
    table = device._table
    byte = bytearray(1)
    slept = False
    for row in range(0, len(table), 3):
        register, value, mask = table[row : row + 3]
        device.load(register, byte)
        if register == _INT_PIN_CFG or register == _INT_ENABLE:
            table[row + 1] = byte[0] & mask
        elif (byte[0] ^ value) & mask:
            device.set_bits(register, value, mask)
            slept = slept or register == _PWR_MGMT_1 or register == _PWR_MGMT_2
    device.rewind()
    return slept
