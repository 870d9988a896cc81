# SPDX-License-Identifier: MIT
"""Which row a board gets, what its chip cannot do, and the knobs that say what nobody knows."""

import pytest

from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.motion import Still

# sys.implementation._machine is MICROPY_HW_BOARD_NAME " with " MICROPY_HW_MCU_NAME, typed from
# ports/esp32/boards and ports/rp2/boards of 1.25, 1.26 and what came until 1.29. The row's name,
# or the board's when it has pins of its own; a text in brackets: a refusal that names the knobs
NAMES = """
esp32 Arduino Nano ESP32 with ESP32S3 | ESP32-S3
esp32 Generic ESP32 module with ESP32 | ESP32
esp32 Generic ESP32 module with SPIRAM with ESP32 | ESP32
esp32 Generic ESP32 module with OTA with ESP32 | ESP32
esp32 ESP32C3 module with ESP32C3 | ESP32-C3
esp32 ESP32C6 module with ESP32C6 | ESP32-C6
esp32 Generic ESP32S2 module with ESP32S2 | ESP32-S2
esp32 Generic ESP32S3 module with ESP32S3 | ESP32-S3
esp32 Generic ESP32S3 module with Octal-SPIRAM with ESP32S3 | ESP32-S3
esp32 ESP32C2 module with ESP32C2 | [unknown chip]
esp32 PYBSTICK26_ESP32C3 with ESP32C3 | ESP32-C3
esp32 LILYGO TTGO LoRa32 with ESP32 | LILYGO TTGO LoRa32
esp32 LOLIN_C3_MINI with ESP32-C3FH4 | ESP32-C3
esp32 LOLIN_S2_MINI with ESP32-S2FN4R2 | ESP32-S2
esp32 LOLIN_S2_PICO with ESP32-S2FN4R2 | ESP32-S2
esp32 M5Stack ATOM with ESP32-PICO-D4 | M5Stack ATOM
esp32 M5Stack AtomS3 Lite with ESP32S3 | M5Stack AtomS3 Lite
esp32 M5Stack NanoC6 with ESP32C6 | M5Stack NanoC6
esp32 Olimex ESP32 ETH with ESP32 | [Ethernet]
esp32 Silicognition wESP32 with ESP32 | [Ethernet]
esp32 SparkFun IoT RedBoard ESP32 with ESP32 | ESP32
esp32 FeatherS2 with ESP32-S2 | FeatherS2
esp32 FeatherS2 Neo with ESP32-S2FN4R2 | FeatherS2 Neo
esp32 FeatherS3 with ESP32-S3 | FeatherS3
esp32 FeatherS3 Neo with ESP32-S3 | FeatherS3 Neo
esp32 NanoS3 with ESP32-S3-FN8 | NanoS3
esp32 OMGS3 with ESP32-S3-PICO-1-N8R2 | ESP32-S3
esp32 ProS3 with ESP32-S3 | ProS3
esp32 RGB Touch Mini with ESP32-S3-PICO-1-N8R2 | [its own pins]
esp32 Unexpected Maker TinyC6 with ESP32C6 | ESP32-C6
esp32 TinyPICO with ESP32-PICO-D4 | ESP32
esp32 TinyS2 with ESP32-S2FN4R2 | TinyS2
esp32 TinyS3 with ESP32-S3-FN8 | TinyS3
esp32 TinyWATCH S3 with ESP32-S3-PICO-1-N8R2 | [its own pins]
esp32 Generic ESP32S3 module with ESP32-S3 | ESP32-S3
esp32 ESP32C3 module with ESP32-C3 | ESP32-C3
esp32 ESP32C6 module with ESP32-C6 | ESP32-C6
esp32 ESP32C5 module with ESP32-C5 | [unknown chip]
esp32 ESP32C61 module with ESP32-C61 | [unknown chip]
esp32 ESP32H2 module with ESP32-H2 | [unknown chip]
esp32 ESP32P4 module with ESP32-P4 | [unknown chip]
esp32 ESP32P4 and C6 module with ESP32P4 | [unknown chip]
esp32 a board of tomorrow with ESP32-S31 | [unknown chip]
rp2 Adafruit Feather RP2040 with RP2040 | Adafruit Feather RP2040
rp2 Adafruit ItsyBitsy RP2040 with RP2040 | Adafruit ItsyBitsy RP2040
rp2 Adafruit QT Py RP2040 with RP2040 | Adafruit QT Py RP2040
rp2 Arduino Nano RP2040 Connect with RP2040 | Arduino Nano RP2040 Connect
rp2 GARATRONIC_PYBSTICK26_RP2040 with RP2040 | Pico
rp2 Machdyne Werkzeug with RP2040 | Pico
rp2 nullbits Bit-C PRO with RP2040 | nullbits Bit-C PRO
rp2 Pimoroni Pico LiPo 4MB with RP2040 | Pico
rp2 Pimoroni Tiny 2040 8MB with RP2040 | Pimoroni Tiny 2040 8MB
rp2 Raspberry Pi Pico with RP2040 | Pico
rp2 Raspberry Pi Pico2 with RP2350 | Pico 2
rp2 Raspberry Pi Pico2 with RP2350-RISCV | Pico 2
rp2 Raspberry Pi Pico 2 W with RP2350 | Pico 2 W
rp2 Raspberry Pi Pico W with RP2040 | Pico W
rp2 Seeed XIAO RP2350 with RP2350 | Seeed XIAO RP2350
rp2 Silicognition RP2040-Shim with RP2040 | Silicognition RP2040-Shim
rp2 SparkFun IoT Node LoRaWAN with RP2350 | SparkFun IoT Node LoRaWAN
rp2 SparkFun IoT RedBoard RP2350 with RP2350 | SparkFun IoT RedBoard RP2350
rp2 SparkFun Pro Micro RP2040 with RP2040 | SparkFun Pro Micro RP2040
rp2 SparkFun Pro Micro RP2350 with RP2350 | SparkFun Pro Micro RP2350
rp2 SparkFun Thing Plus RP2040 with RP2040 | SparkFun Thing Plus RP2040
rp2 SparkFun Thing Plus RP2350 with RP2350 | SparkFun Thing Plus RP2350
rp2 SparkFun XRP Controller with RP2350 | SparkFun XRP Controller
rp2 SparkFun XRP Controller (Beta) with RP2040 | SparkFun XRP Controller (Beta)
rp2 W5100S-EVB-Pico with RP2040 | W5100S-EVB-Pico
rp2 W5500-EVB-Pico with RP2040 | W5500-EVB-Pico
rp2 WeAct Studio RP2040 with RP2040 | Pico
rp2 WeAct Studio RP2350B Core with RP2350 | Pico 2
esp32 Generic ESP32 module with D2WD with ESP32 | ESP32
esp32 Generic ESP32 module with UNICORE with ESP32 | ESP32
esp32 Seeed XIAO ESP32C3 with ESP32-C3FN4 | Seeed XIAO ESP32C3
esp32 Seeed XIAO ESP32C6 with ESP32C6 | Seeed XIAO ESP32C6
esp32 Seeed XIAO ESP32S3 with ESP32-S3-FN8 | Seeed XIAO ESP32S3
esp32 M5Stack NanoH2 with ESP32-H2 | [unknown chip]
esp32 M5Stack NanoC6 with ESP32-C6 | M5Stack NanoC6
esp32 Generic ESP32S31 module with ESP32-S31 | [unknown chip]
esp32 M5Stack AtomS3 Lite with ESP32-S3 | M5Stack AtomS3 Lite
esp32 Generic ESP32S2 module with ESP32-S2 | ESP32-S2
esp32 Generic ESP32S3 module with Octal-SPIRAM with ESP32-S3 | ESP32-S3
esp32 Arduino Nano ESP32 with ESP32-S3 | ESP32-S3
esp32 PYBSTICK26_ESP32C3 with ESP32-C3 | ESP32-C3
esp32 Unexpected Maker TinyC6 with ESP32-C6 | ESP32-C6
rp2 Pimoroni Pico LiPo 16MB with RP2040 | Pico
rp2 Pimoroni Tiny 2040 2MB with RP2040 | Pimoroni Tiny 2040 2MB
rp2 Pololu 3pi+ 2040 Robot | [no chip named]
rp2 Pololu Zumo 2040 Robot | [no chip named]
rp2 Seeed XIAO RP2040 with RP2040 | Seeed XIAO RP2040
rp2 Cytron MOTION 2350 Pro with RP2350 | Pico 2
rp2 W5100S-EVB-Pico2 with RP2350 | W5100S-EVB-Pico2
rp2 W5500-EVB-Pico2 with RP2350 | W5500-EVB-Pico2
rp2 W6100-EVB-Pico with RP2040 | W6100-EVB-Pico
rp2 W6100-EVB-Pico2 with RP2350 | W6100-EVB-Pico2
rp2 W6300-EVB-Pico with RP2040 | W6300-EVB-Pico
rp2 W6300-EVB-Pico2 with RP2350 | W6300-EVB-Pico2
rp2 W55RP20-EVB-Pico with RP2040 | Pico
rp2 Waveshare RP2350B Core with RP2350 | Pico 2
rp2 Waveshare RP2040-LCD-0.96 with RP2040 | Pico
""".strip().splitlines()

# what each chip's data sheet says of pins that are none: flash, USB, input only, must be high or
# low at boot; the knob that asks for it, a word of the refusal
CANNOT = [
    ("RP2040", "pin_sda", 30, "exist"), ("RP2040W", "pin_out_1", 25, "radio"),
    ("ESP32", "pin_sda", 6, "flash"), ("ESP32", "pin_scl", 11, "flash"),
    ("ESP32", "pin_scl", 34, "no output"), ("ESP32", "pin_out_1", 39, "no output"),
    ("ESP32", "pin_sda", 12, "low when"), ("ESP32", "pin_out_2", 0, "high when"),
    ("ESP32", "pin_sda", 20 + 4, "exist"), ("ESP32", "pin_int", 1, "console"),
    ("ESP32S2", "pin_sda", 26, "flash"), ("ESP32S2", "pin_sda", 46, "no output"),
    ("ESP32S3", "pin_sda", 22, "exist"), ("ESP32S3", "pin_scl", 25, "exist"),
    ("ESP32S3", "pin_sda", 19, "USB"), ("ESP32S3", "pin_sda", 45, "low when"),
    ("ESP32C3", "pin_sda", 18, "USB"), ("ESP32C3", "pin_scl", 14, "flash"),
    ("ESP32C3", "pin_int", 9, "high when"), ("ESP32C3", "pin_out_1", 8, "high when"),
    ("ESP32C6", "pin_sda", 24, "flash"), ("ESP32C6", "pin_sda", 12, "USB"),
]  # fmt: skip
CAN = [
    ("ESP32", "pin_int", 34), ("ESP32C3", "pin_sda", 8), ("ESP32C3", "pin_scl", 9),
    ("ESP32", "pin_sda", 0), ("ESP32", "pin_int", 12), ("RP2350", "pin_out_1", 40),
]  # fmt: skip
PLATFORM = {"RP2040": "rp2", "RP2040W": "rp2", "RP2350": "rp2"}
EVERY = ("RP2040", "RP2040W", "RP2350", "ESP32", "ESP32S2", "ESP32S3", "ESP32C3", "ESP32C6")


def port_of(machine, buses=None, version=(1, 27, 0), **settings):
    return Port(
        PLATFORM.get(machine, "esp32"), buses, machine_name=machine, version=version, **settings
    )


@pytest.fixture
def boards():
    with Port("esp32", version=(1, 27, 0)):
        from firmware import board, chips

        yield board, chips


@pytest.mark.parametrize("line", NAMES)
def test_every_name_of_micropythons_boards_gets_its_row_or_a_refusal(boards, line):
    board, _ = boards
    (platform, machine), expected = line.split(" | ")[0].split(" ", 1), line.split(" | ")[1]
    if expected.startswith("["):
        with pytest.raises(OSError, match=r"no pins known for .*pin_sda and pin_scl"):
            board.find(platform, machine)
        return
    made = board.find(platform, machine)
    assert made.name == expected
    chip = machine.rpartition(" with ")[2].replace("-", "")
    assert chip.startswith(made.row.chip)  # the exact chip
    if made.row.chip == "ESP32":
        assert chip == "ESP32" or chip[5:].startswith("PICO")


def test_the_rows_of_all_boards_that_are_named(boards):
    _, chips = boards
    named = [row.name for row in chips.ROWS]
    assert named == ["Pico", "Pico W", "Pico 2", "Pico 2 W", "ESP32", "ESP32-S2", "ESP32-S3",
                     "ESP32-C3", "ESP32-C6"]  # fmt: skip


def test_what_a_row_gives_its_chip_can_do(boards):
    from firmware.row import bus_of, reason

    _, chips = boards
    others = [chips.find(*line.split(" | ")[0].split(" ", 1)) for line in NAMES]
    for row in [*chips.ROWS, *[row for row in others if row.sda is not None]]:
        pins = [(row.sda, "sda"), (row.scl, "scl")] + [(pin, "out") for pin in row.outputs]
        if row.int_pin is not None:
            pins.append((row.int_pin, "int"))
        assert [(row.name, pin, use, reason(row, pin, use)) for pin, use in pins
                if reason(row, pin, use)] == []  # fmt: skip
        assert len({pin for pin, _ in pins}) == len(pins) <= 7
        assert bus_of(row, row.sda, row.scl) in (0, 1)
    assert all(len(row.outputs) == 4 and row.int_pin is not None for row in chips.ROWS)


def test_each_board_with_pins_of_its_own_is_one_of_micropythons(boards):
    from firmware.pinouts import PINS

    names = [line.rpartition(":")[0] for line in PINS.strip().splitlines()]
    here = [line.split(" | ")[0].split(" ", 1)[1].rpartition(" with ")[0] for line in NAMES]
    assert len(names) == len(set(names)) > 40
    assert [name for name in names if name not in here] == []


@pytest.mark.parametrize("machine, sda, scl, outputs", [
    ("Seeed XIAO RP2350 with RP2350", 6, 7, (26, 27, 5, 2)),
    ("SparkFun XRP Controller (Beta) with RP2040", 18, 19, (16, 17)),
    ("TinyS3 with ESP32-S3-FN8", 9, 8, (4, 5, 6, 7)),
])  # fmt: skip
def test_a_board_with_pins_of_its_own_has_its_chips_rules(boards, machine, sda, scl, outputs):
    from firmware.row import reason

    board, _ = boards
    made = board.find("rp2" if "RP2" in machine else "esp32", machine)
    assert (made.sda, made.scl, made.outputs) == (sda, scl, outputs)
    assert made.int_pin is None or made.name == "Seeed XIAO RP2350"
    assert reason(made.row, 60, "sda") and not reason(made.row, 4, "sda")


@pytest.mark.parametrize("machine", EVERY)
def test_each_chip_runs_on_the_pins_of_its_row(machine, tmp_path):
    with port_of(machine, {0: Bus(MPU6050Chip(seed=3))}, root=tmp_path) as port:
        from firmware.app import App

        app = App()
        app.start()
        port.run_ms(300)
        assert not app.stale and port.errors == []
        assert app.board.row.chip == machine.removesuffix("W")


@pytest.mark.parametrize("machine, knob, pin, word", CANNOT)
def test_what_a_chip_cannot_do_is_refused_with_the_reason(machine, knob, pin, word, tmp_path):
    with port_of(machine, root=tmp_path):
        from firmware.app import App

        app = App()
        with pytest.raises(ValueError, match=r"%s = %d.*%s" % (knob, pin, word)):
            app.set(knob, pin)
        assert app.changed() == {}


@pytest.mark.parametrize("machine, knob, pin", CAN)
def test_what_a_chip_can_do_is_allowed(machine, knob, pin, tmp_path):
    with port_of(machine, root=tmp_path):
        from firmware.app import App

        app = App()
        app.set(knob, pin)
        assert app.changed() == {knob: pin}


def test_the_i2c_blocks_of_a_pico_take_the_pins_that_the_port_takes(tmp_path):
    with port_of("RP2040", root=tmp_path):
        import machine

        from firmware import chips
        from firmware.row import bus_of

        row = chips.find("rp2", "Raspberry Pi Pico with RP2040")
        for sda in range(30):
            for scl in range(30):
                try:
                    block = bus_of(row, sda, scl)
                except ValueError:
                    block = None
                takes = []
                for number in (0, 1):
                    try:
                        machine.I2C(number, sda=machine.Pin(sda), scl=machine.Pin(scl))
                        takes.append(number)
                    except ValueError:
                        pass
                assert takes == ([] if block is None else [block]), (sda, scl)


# ---- knobs


def wired(machine, bus_id, sda, scl, tmp_path, **settings):
    bus = Bus(MPU6050Chip(Still(roll_deg=10.0), seed=3))
    return port_of(machine, {bus_id: bus}, wiring={bus_id: (sda, scl)}, root=tmp_path, **settings)


@pytest.mark.parametrize("machine, bus_id, sda, scl", [
    ("RP2040", 0, 12, 13), ("RP2040", 1, 2, 3), ("RP2350", 1, 26, 27), ("ESP32", 0, 32, 33),
    ("ESP32", 1, 32, 33), ("ESP32S3", 0, 1, 2), ("ESP32C3", 0, 8, 9),
])  # fmt: skip
def test_pins_and_bus_are_knobs_that_are_saved(machine, bus_id, sda, scl, tmp_path):
    with wired(machine, bus_id, sda, scl, tmp_path) as port:
        from firmware.app import App

        app = App()
        app.set("pin_sda", sda)
        app.set("pin_scl", scl)
        if PLATFORM.get(machine) != "rp2":
            app.set("bus", bus_id)
        app.start()
        port.run_ms(300)
        assert app.roll_deg == pytest.approx(10.0, abs=0.5)
        assert (app.board.sda, app.board.scl, app.board.i2c_id) == (sda, scl, bus_id)
        app.save()
        app.stop()
        again = App()
        again.start()
        port.run_ms(300)
        assert again.roll_deg == pytest.approx(10.0, abs=0.5)


@pytest.mark.parametrize("machine", ["ESP32", "RP2040"])
def test_an_unknown_board_says_which_knobs_and_runs_with_them(machine, tmp_path):
    sda, scl = (32, 33) if machine == "ESP32" else (12, 13)
    with wired(machine, 0, sda, scl, tmp_path) as port:
        port.modules["sys"].implementation._machine = "A board of mine with XYZ-1"
        from firmware.app import App

        app = App()
        with pytest.raises(OSError) as caught:
            app.start()
        text = str(caught.value)
        assert "A board of mine with XYZ-1" in text
        assert "pin_sda" in text and "pin_scl" in text and 'app.set("pin_sda", 8)' in text
        app.set("pin_sda", sda)
        with pytest.raises(OSError, match="pin_scl"):
            app.start()
        app.set("pin_scl", scl)
        app.start()
        port.run_ms(300)
        assert app.roll_deg == pytest.approx(10.0, abs=0.5)
        with pytest.raises(OSError, match="pin_int"):
            app.set("drive", "data-ready")
        assert app.config.drive == "timer" and app.running


@pytest.mark.parametrize("machine", ["RP2040", "ESP32"])
def test_wrong_pins_while_it_runs_leave_all_as_it_was(machine, tmp_path):
    sda, scl = (4, 5) if machine == "RP2040" else (21, 22)
    with wired(machine, 0, sda, scl, tmp_path) as port:
        from firmware.app import App

        app = App()
        app.start()
        port.run_ms(300)
        if machine == "RP2040":
            with pytest.raises(ValueError, match="I2C1 has SDA"):
                app.set("pin_sda", 2)  # by itself it goes with no clock of the same block
        else:
            with pytest.raises(OSError, match="Seen: "):
                app.set("pin_sda", 32)
        assert app.changed() == {} and app.running
        port.run_ms(300)
        assert not app.stale and app.roll_deg == pytest.approx(10.0, abs=0.5)
        assert (app.board.sda, app.board.scl) == (sda, scl)


def test_two_uses_of_a_pin_are_refused(tmp_path):
    with wired("ESP32", 0, 21, 22, tmp_path):
        from firmware.app import App

        app = App()
        app.set("pin_out_1", 21)
        with pytest.raises(ValueError, match="GP21 is to be two things"):
            app.start()


@pytest.mark.parametrize("machine", ["RP2040", "ESP32"])
@pytest.mark.parametrize("bus_hz, rate_hz", [(100000, 250), (100000, 400), (50000, 200)])
def test_a_slower_bus_and_the_lead_that_goes_with_it(machine, bus_hz, rate_hz, tmp_path):
    sda, scl = (4, 5) if machine == "RP2040" else (21, 22)
    with wired(machine, 0, sda, scl, tmp_path) as port:
        from firmware.app import App

        app = App()
        app.set("rate_hz", rate_hz)
        app.set("bus_hz", bus_hz)
        app.start()
        port.run_ms(1000)
        stats = app.stats()
        assert stats["predicted"] <= 2 and stats["lost"] == 0
        assert app.roll_deg == pytest.approx(10.0, abs=0.5)
        with pytest.raises(ValueError, match="a burst takes"):
            app.set("rate_hz", 1000)
        assert app.config.rate_hz == rate_hz and app.running


@pytest.mark.parametrize("stopped", [False, True])
def test_a_bus_too_slow_for_the_rate_is_refused_before_a_start_too(stopped, tmp_path):
    with wired("ESP32", 0, 21, 22, tmp_path) as port:
        from firmware.app import App

        app = App()
        if stopped:
            app.start()
            port.run_ms(100)
            app.stop()
        for name, value in (("bus_hz", 10000), ("rate_hz", 1000)):
            if name == "rate_hz":
                app.set("bus_hz", 100000)
            with pytest.raises(ValueError, match="a burst takes"):
                app.set(name, value)
        assert app.changed() == {"bus_hz": 100000}


def test_what_would_not_start_is_not_saved(tmp_path):
    with wired("RP2040", 0, 12, 13, tmp_path) as port:
        from firmware.app import App

        app = App()
        app.set("pin_sda", 12)
        app.save()  # I2C0 has SDA on 12 and SCL on 5
        app.set("pin_scl", 7)  # which is of I2C1
        with pytest.raises(ValueError, match="I2C1 has SDA"):
            app.save()
        app.set("pin_scl", 13)
        app.set("pin_out_2", 13)
        with pytest.raises(ValueError, match="GP13 is to be two things"):
            app.save()
        app.set("pin_out_2", 14)
        app.save()
        app = App()
        assert app.changed() == {"pin_sda": 12, "pin_scl": 13, "pin_out_2": 14}
        app.start()
        port.run_ms(100)
        assert not app.stale
        # knobs of a chip that is to be sought anew
        app.stop()
        app.set("address", 0x69)
        for name, value in (("gyro_dps", 1000), ("filter", "kalman2"), ("rate_hz", 200)):
            app.set(name, value)
        app.set("address", 0x68)
        app.start()
        port.run_ms(100)
        assert not app.stale and app.imu.gyro_range_dps == 1000


def test_pins_of_outputs_are_knobs(tmp_path):
    with wired("ESP32S3", 0, 8, 9, tmp_path):
        from firmware.app import App

        app = App()
        app.set("pin_out_1", 12)
        app.set("pin_out_2", 13)
        app.start()
        assert app.board.outputs == (12, 13, 6, 7)
        app.set("pin_out_3", 14)
        assert app.board.outputs == (12, 13, 14, 7) and app.running


# ---- too old


@pytest.mark.parametrize("machine, version, good", [
    ("RP2040", (1, 22, 0), False), ("RP2040", (1, 23, 0), True), ("ESP32", (1, 22, 0), False),
    ("ESP32C3", (1, 23, 0), False), ("ESP32C3", (1, 24, 0), True), ("ESP32", (1, 24, 0), True),
])  # fmt: skip
def test_an_old_micropython_is_refused_with_the_one_that_is_needed(
    machine, version, good, tmp_path
):
    with port_of(machine, {0: Bus(MPU6050Chip(seed=3))}, version, root=tmp_path) as port:
        from firmware.app import App

        app = App()
        if good:
            app.start()
            port.run_ms(100)
            assert not app.stale
        else:
            with pytest.raises(OSError, match=r"MicroPython 1.2\d is too old.*needs 1.2[34]"):
                app.start()


# ---- two sensors


TWO = {  # machine, where each is: knobs by App
    "one bus": [{}, {"address": 0x69}],
    "two buses": [{}, {"bus": 1}],
}


@pytest.mark.parametrize("drive", ["timer", "data-ready"])
@pytest.mark.parametrize("where", TWO)
@pytest.mark.parametrize("machine", ["RP2040", "ESP32", "ESP32S3"])
def test_two_sensors_two_apps(machine, where, drive, tmp_path):
    low = MPU6050Chip(Still(roll_deg=10.0), seed=3, gyro_bias_dps=(3.0, 0.0, 0.0))
    high = MPU6050Chip(
        Still(roll_deg=-20.0), seed=4, gyro_bias_dps=(-4.0, 0.0, 0.0),
        address=0x69 if where == "one bus" else 0x68,
    )  # fmt: skip
    second = (2, 3) if machine == "RP2040" else (32, 33) if machine == "ESP32" else (1, 2)
    first = {"RP2040": (4, 5), "ESP32": (21, 22)}.get(machine, (8, 9))
    if where == "one bus":
        buses, wiring = {0: Bus(low, high)}, {0: first}
    else:
        buses, wiring = {0: Bus(low), 1: Bus(high)}, {0: first, 1: second}
    with port_of(machine, buses, wiring=wiring, root=tmp_path) as port:
        from firmware.app import App

        left, right = App(), App(name="right")
        for name, value in TWO[where][1].items():
            right.set(name, value)
        if where == "two buses":
            right.set("pin_sda", second[0])
            right.set("pin_scl", second[1])
        right.set("pin_int", 11 if machine == "RP2040" else 13)
        for app in (left, right):
            app.set("drive", drive)
        for app, chip in ((left, low), (right, high)):
            port.connect_int(chip, right.config.pin_int if app is right else app.board.int_pin)
            app.start()
            assert not left.stale  # the other's start takes turns with its ticks
        port.run_ms(100)
        before = {app: app.stats() for app in (left, right)}
        assert before[left]["predicted"] < 90
        port.run_ms(2000)
        for app, roll in ((left, 10.0), (right, -20.0)):
            stats = app.stats()
            assert not app.stale and app.roll_deg == pytest.approx(roll, abs=0.5)
            assert stats["errors"] == 0
            assert stats["predicted"] - before[app]["predicted"] < 20
            assert 495 <= stats["ticks"] - before[app]["ticks"] <= 505
            assert stats.get("nack", 0) == stats.get("timeout", 0) == 0
        left.set("gyro_dps", 1000)
        right.set("rate_hz", 200)
        right.save()
        left.stop()
        port.run_ms(500)
        assert not right.stale and right.roll_deg == pytest.approx(-20.0, abs=0.5)
        left.start()
        port.run_ms(500)
        assert left.roll_deg == pytest.approx(10.0, abs=0.5) and port.errors == []
        assert (tmp_path / "right.config.txt").exists()
        assert not (tmp_path / "config.txt").exists()
        with pytest.raises(OSError, match="has a running App"):
            App().start()


def test_there_are_as_many_apps_as_timers(tmp_path):
    chips = [MPU6050Chip(seed=3), MPU6050Chip(seed=4, address=0x69)]
    with port_of("ESP32C3", {0: Bus(*chips)}, root=tmp_path) as port:
        import machine

        from firmware.app import App

        left, right = App(), App(name="right")
        right.set("address", 0x69)
        left.start()
        right.start()
        port.run_ms(500)
        assert not left.stale and not right.stale
        from firmware.board import find

        with pytest.raises(OSError, match="no timer left: ESP32-C3 has 2"):
            find().timer(4000, print)
        left.stop()
        find().timer(4000, lambda _timer: None).deinit()
        left.start()
        port.run_ms(300)
        assert not left.stale
        assert machine.Timer._numbered.keys() == {0, 1}
