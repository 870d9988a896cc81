# SPDX-License-Identifier: MIT
"""The PWM outputs of an emulated Pico, in the form in which plants read those of the Port."""

_CLOCK_HZ = 125e6


class PicoPins:
    """`pin(number).pwm.history` of a VirtualPico: one entry, what the output carries now."""

    def __init__(self, pico):
        self._channels = pico._mcu.pwm.channels

    def pin(self, number):
        """The pin; its pwm is None while the output is off."""
        return _Pin(self._channels[number >> 1 & 7], number & 1)


class _Pin:
    def __init__(self, channel, second):
        self._channel = channel
        self._second = second

    @property
    def pwm(self):
        return self if self._channel.csr & 1 else None

    @property
    def history(self):
        """((0, frequency in Hz, duty of 65535),)."""
        channel = self._channel
        period = channel.top + 1
        divider = channel.div / 16
        high = channel.cc >> 16 if self._second else channel.cc & 0xFFFF
        return ((0, _CLOCK_HZ / divider / period, min(1.0, high / period) * 65535),)
