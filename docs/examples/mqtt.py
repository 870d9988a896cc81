# SPDX-License-Identifier: MIT
"""The angles to an MQTT broker, once a second, as JSON: Pico W, Pico 2 W and ESP32.

The client is micropython-lib's; once, with the board in the Wi-Fi or from the PC:
    mpremote mip install umqtt.simple
Set the three names below. Wire as print_angles.py.
"""

import json
import time

import network
from umqtt.simple import MQTTClient

from firmware.app import App

SSID, KEY = "the network's name", "its key"
BROKER, TOPIC = "192.168.1.2", b"plumb/attitude"

app = App()
app.start()
wlan = network.WLAN(network.STA_IF)
wlan.active(True)
wlan.connect(SSID, KEY)
client = MQTTClient(b"plumb", BROKER)
connected = False
while True:
    time.sleep(1)
    if not wlan.isconnected():
        continue
    now = app.sample()
    angles = {"roll": now.roll_deg, "pitch": now.pitch_deg, "yaw": now.yaw_deg}
    angles["stale"] = now.stale
    try:
        if not connected:
            client.connect()
        connected = True
        client.publish(TOPIC, json.dumps(angles).encode())
    except OSError as error:  # the broker is away: the angles go on, and it is tried again
        print("broker:", error)
        connected = False
