# SPDX-License-Identifier: MIT
"""What the bus's wires show when the sensor does not answer; loaded only then."""


def diagnose(board, address):
    """Why the sensor does not answer: one text that names what was seen and what to check.

    Call it after the construction of the driver failed; it bit-bangs the bus, so the I2C object
    must be made anew afterwards.
    """
    wires = "SDA GP%d, SCL GP%d" % (board.sda, board.scl)
    names = ("SDA", "SCL")
    up = board.line_levels(True)
    stuck = [names[i] for i in (0, 1) if not up[i]]
    if stuck:
        return (
            "%s held low (%s): a device hangs in a transfer or the wire touches GND. "
            "Check: take the sensor's power away for a moment; no short to GND"
            % (" and ".join(stuck), wires)
        )
    down = board.line_levels(False)
    floating = [names[i] for i in (0, 1) if not down[i]]
    if floating:
        return (
            "no pull-up on %s (%s): the line follows the board's weak pull. "
            "Check: sensor's VCC and GND connected, the wire itself; a bare chip needs 4.7 kOhm "
            "from each line to 3.3 V" % (" and ".join(floating), wires)
        )
    found = board.scan()
    if address in found:
        return "address 0x%02x answers now (%s): a loose contact. Check the plugs" % (
            address,
            wires,
        )
    if found:
        return "no device at 0x%02x, found: %s (%s). Check: AD0 low is 0x68, high 0x69; %s" % (
            address,
            ", ".join(["0x%02x" % a for a in found]),
            wires,
            'app.set("address", ...) takes the other',
        )
    if board.scan(swapped=True):
        return "SDA and SCL are swapped: the sensor answers the other way round. Check: %s" % wires
    return (
        "both lines are high but no device answers (%s). "
        "Check: sensor's VCC and GND, CS/nCS high, the right pins; SCL is not on SDA" % wires
    )
