# SPDX-License-Identifier: MIT
"""What a chip can do, and what is asked of that: the row of firmware.chips that is kept."""


class Row:
    """A chip, or a board on it.

    name; platform and chip (None: unknown); by default sda, scl, int_pin (None: nobody knows) and
    outputs; timers: the ids of MicroPython's; buses: I2C blocks; pins: how many GPIO numbers;
    gone: those that do not exist, or hold flash, USB, console, radio; inputs: those without an
    output; straps: {pin: its level when the board boots}; least: MicroPython's version;
    deaf_before: older ones do not heed the bus's timeout.
    """

    gone = inputs = outputs = ()
    straps = {}  # type: dict
    sda = scl = int_pin = chip = None
    timers = (0, 1)
    buses, pins = 2, 64
    least, deaf_before = (1, 23), (0, 0)

    def __init__(self, name, platform, **facts):
        self.name, self.platform = name, platform
        for fact in facts:
            setattr(self, fact, facts[fact])

    def but(self, name, **facts):
        """The same for one board."""
        own = self.__dict__.copy()
        del own["name"]
        own.update(facts)
        return Row(name, **own)


def reason(row, pin, use):
    """Why `pin` cannot be this: "sda", "scl", "int" or "out"; empty when it can."""
    if not 0 <= pin < row.pins or pin in row.gone:
        return "it does not exist, or holds the flash, USB, the console or the radio"
    if pin in row.inputs and use != "int":
        return "it has no output"
    level = 1 if use in ("sda", "scl") else 0  # to which it is pulled while the board boots
    if row.straps.get(pin, level) != level:
        return "it must be %s when the board boots" % ("high" if row.straps[pin] else "low")
    return ""


def bus_of(row, sda, scl, wanted=-1):
    """Number of the I2C block for these pins; wanted: -1 any. ValueError says which fit."""
    if row.platform != "rp2":
        if wanted >= row.buses:
            raise ValueError("bus = %d: there is %d on %s" % (wanted, row.buses, row.name))
        return max(0, wanted)
    block = sda // 2 % 2
    if sda % 2 or scl % 2 == 0 or scl // 2 % 2 != block or wanted not in (-1, block):
        raise ValueError(
            "pin_sda = %d, pin_scl = %d: I2C0 has SDA on 0, 4, 8 ... and SCL on 1, 5, 9 ..., "
            "I2C1 has SDA on 2, 6, 10 ... and SCL on 3, 7, 11 ..." % (sda, scl)
        )
    return block
