# SPDX-License-Identifier: MIT
"""A device behind an MPU6050, on its XDA and XCL: reached where the chip connects them through."""

from tools.virtual.chip import registers as reg

_I2C_BYPASS_EN, _I2C_MST_EN = 0x02, 0x20


class Behind:
    """`device` (tools.virtual.bus) on the auxiliary bus of `chip`; both belong on the same Bus.

    It answers while I2C_BYPASS_EN is set and I2C_MST_EN is not (RM-MPU-6000A 4.14), the chip
    having its supply.
    """

    def __init__(self, device, chip):
        self.device, self.chip = device, chip
        self.address = device.address

    def start(self, read):
        """Addressed, if the chip lets it through."""
        registers = self.chip.registers
        through = registers[reg.INT_PIN_CFG] & _I2C_BYPASS_EN
        return bool(
            through
            and not registers[reg.USER_CTRL] & _I2C_MST_EN
            and self.chip._powered
            and self.device.start(read)
        )

    def __getattr__(self, name):
        return getattr(self.device, name)
