# SPDX-License-Identifier: MIT
"""Boards on which those pins of their chip's row are not led out, or busy with something else.

Text, since it is read once, on such a board. A line: MicroPython's name of the board, then SDA,
SCL, INT (-: nobody knows) and outputs; nothing: the board uses its pins itself. What is marked
I2C on the board comes first. Sources: MicroPython's ports/*/boards, pico-sdk's board headers, the
makers' pinouts.
"""

PINS = """
Adafruit Feather RP2040: 2 3 6 9 10 11 12
Adafruit ItsyBitsy RP2040: 2 3 6 8 9 10 11
Adafruit QT Py RP2040: 24 25 6 29 28 27 26
Arduino Nano RP2040 Connect: 12 13 25 16 17 18 19
nullbits Bit-C PRO: 2 3 6
Pimoroni Tiny 2040 8MB: 4 5 6 0 1 2 3
Pimoroni Tiny 2040 2MB: 4 5 6 0 1 2 3
Seeed XIAO RP2040: 6 7 28 26 27 29 2
Seeed XIAO RP2350: 6 7 28 26 27 5 2
Silicognition RP2040-Shim: 16 17 -
SparkFun IoT Node LoRaWAN: 20 21 -
SparkFun IoT RedBoard RP2350: 4 5 -
SparkFun Pro Micro RP2040: 16 17 4 20 21 22 23
SparkFun Pro Micro RP2350: 16 17 4 20 21 22 23
SparkFun Thing Plus RP2040: 6 7 - 16 17 18 19
SparkFun Thing Plus RP2350: 6 7 -
SparkFun XRP Controller: 4 5 - 6 9 7 8
SparkFun XRP Controller (Beta): 18 19 - 16 17
W5100S-EVB-Pico: 4 5 6 10 11 12 13
W5100S-EVB-Pico2: 4 5 6 10 11 12 13
W5500-EVB-Pico: 4 5 6 10 11 12 13
W5500-EVB-Pico2: 4 5 6 10 11 12 13
W6100-EVB-Pico: 4 5 6 10 11 12 13
W6100-EVB-Pico2: 4 5 6 10 11 12 13
W6300-EVB-Pico: 4 5 6 10 11 12 13
W6300-EVB-Pico2: 4 5 6 10 11 12 13
FeatherS2: 9 8 - 5 6 7
FeatherS2 Neo: 9 8 - 5 6 7
FeatherS3: 8 9 10 5 6 7
FeatherS3 Neo: 8 9 10 5 6 7
NanoS3: 9 8 - 4 5 6 7
ProS3: 9 8 - 4 5 6 7
TinyS2: 9 8 - 4 5 6 7
TinyS3: 9 8 - 4 5 6 7
LILYGO TTGO LoRa32: 21 22 34 32 33 25 4
M5Stack ATOM: 26 32 22 23 33
M5Stack AtomS3 Lite: 38 39 - 5 6 7 8
M5Stack NanoC6: 2 1 -
Seeed XIAO ESP32C3: 6 7 10 3 4 5
Seeed XIAO ESP32C6: 22 23 2 18 19 20 21
Seeed XIAO ESP32S3: 5 6 9 1 2 4 7
Olimex ESP32 ETH:
Silicognition wESP32:
RGB Touch Mini:
TinyWATCH S3:
"""


def pins_of(board):
    """{fact of firmware.row.Row: its value} of this board; empty: those of its chip's row."""
    begin = PINS.find("\n%s:" % board)
    if begin < 0:
        return {}
    begin += len(board) + 2
    words = PINS[begin : PINS.find("\n", begin)].split()
    pins = [None if word == "-" else int(word) for word in words] or [None, None, None]
    return {"sda": pins[0], "scl": pins[1], "int_pin": pins[2], "outputs": tuple(pins[3:])}
