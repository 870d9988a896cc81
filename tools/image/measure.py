# SPDX-License-Identifier: MIT
"""What an install costs on the emulated RP2040: heap, import, collection, start.

Each figure comes from a real boot with a virtual MPU6050 at rest on the bus. Times are emulated:
the board's own microseconds, and for the start those since power came on.
"""

import ast
import re

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040 import flash

EMPTY = {"main.py": ""}  # an empty main.py starts nothing
START_S = 20  # emulated seconds within which the first angle has to come
ANGLE = re.compile(rb"\nroll\S* *-?\d[^\n]*\n")  # a line of telemetry, whole

# Everything after the first collection is the app's; a collection before each look.
_COST = """
import gc, time
gc.collect()
empty = gc.mem_alloc()
began = time.ticks_us()
from firmware.app import App
took = time.ticks_diff(time.ticks_us(), began)
app = App()
app.start()
def collected():
    began = time.ticks_us()
    gc.collect()
    return time.ticks_diff(time.ticks_us(), began)
collections = [collected() for _ in range(5)]
print({
    "heap_used": gc.mem_alloc() - empty,
    "heap_free": gc.mem_free(),
    "import_ms": round(took / 1000, 1),
    "collect_ms": round(max(collections) / 1000, 2),
})
app.stop()
"""


def frozen(image):
    """The figures of an image that has Plumb frozen in."""
    return {**_cost(image, EMPTY), "start_ms": start_ms(image, {})}


def copied(image):
    """The figures of a plain image with the project on its flash as .mpy, as deploy leaves it."""
    return {**heap(image), "start_ms": start_ms(image, flash.compiled(flash.project_files()))}


def heap(image):
    """What a copied install costs, without its start: heap, import, one collection."""
    return _cost(image, {**flash.compiled(flash.project_files()), **EMPTY})


def _cost(image, files):
    with VirtualPico(bus=Bus(MPU6050Chip(seed=1)), files=files, mpy=False, image=image) as pico:
        return ast.literal_eval(pico.exec(_COST, timeout_s=START_S))


def start_ms(image, files):
    """From power-on to the first printed angle, ms, on a flash that a start has left behind."""
    with VirtualPico(files=files, mpy=False, image=image) as pico:
        on_flash = pico.files()  # the first start of an image writes main.py
    pico = VirtualPico(Bus(MPU6050Chip(seed=1)), files=on_flash, mpy=False, image=image)
    return round(pico.boot_until(ANGLE, START_S))
