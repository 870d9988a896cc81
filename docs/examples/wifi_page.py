# SPDX-License-Identifier: MIT
"""A page with the angles, for any browser in the same Wi-Fi: Pico W, Pico 2 W and ESP32.

Set the two names below; the address of the page is printed. Wire as print_angles.py.
"""

import asyncio

import network

from firmware.app import App

SSID, KEY = "the network's name", "its key"
PAGE = """HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<!doctype html>
<meta http-equiv="refresh" content="1"><title>Attitude</title>
<h1>roll %.2f&deg; pitch %.2f&deg; yaw %.2f&deg;</h1><p>%s</p>"""


async def answer(reader, writer):
    """One request: whatever is asked for, the angles of this instant."""
    while await reader.readline() not in (b"\r\n", b""):
        pass
    now = app.sample()
    state = "stale" if now.stale else "uncertain" if now.uncertain else "fresh"
    writer.write((PAGE % (now.roll_deg, now.pitch_deg, now.yaw_deg, state)).encode())
    await writer.drain()
    writer.close()
    await writer.wait_closed()


async def main():
    wlan = network.WLAN(network.STA_IF)
    wlan.active(True)
    wlan.connect(SSID, KEY)
    while not wlan.isconnected():
        await asyncio.sleep(0.1)
    await asyncio.start_server(answer, "0.0.0.0", 80)
    print("http://%s/" % wlan.ifconfig()[0])
    while True:
        await asyncio.sleep(60)


app = App()
app.start()
asyncio.run(main())
