# SPDX-License-Identifier: MIT
"""Headless Chromium, by its own debugging protocol. Where it is not, tests fail and say so."""

import base64
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request

from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome")
START_S = 60


class Browser:
    """One page of a browser without a window: `with Browser(url) as page:`."""

    def __init__(self, url, width=1500, height=1000, dark=False):
        self._url, self._size, self._dark = url, (width, height), dark
        self._number = 0
        self.events = []

    def __enter__(self):
        program = next(filter(None, map(shutil.which, NAMES)), None)
        if program is None:
            raise RuntimeError("no Chromium: apt-get install chromium (.ci/run does)")
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--mute-audio",
             "--remote-debugging-port=0", "--remote-allow-origins=*",
             f"--user-data-dir={self._folder.name}",
             "about:blank"],
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        line = next(text for text in self._process.stderr if "DevTools listening" in text)
        port = line.split(":")[2].split("/")[0]
        end = time.monotonic() + START_S
        while True:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
                pages = [item for item in json.load(answer) if item["type"] == "page"]
            if pages or time.monotonic() > end:
                break
            time.sleep(0.1)
        self._line = connect(pages[0]["webSocketDebuggerUrl"], max_size=None)
        self._socket = self._line.__enter__()
        self.do("Page.enable")
        self.do("Network.enable")
        self.do("Runtime.enable")
        if self._dark:
            feature = {"name": "prefers-color-scheme", "value": "dark"}
            self.do("Emulation.setEmulatedMedia", features=[feature])
        self.do("Emulation.setDeviceMetricsOverride", width=self._size[0], height=self._size[1],
                deviceScaleFactor=1, mobile=False)  # fmt: skip
        self.do("Page.navigate", url=self._url)
        return self

    def __exit__(self, *error):
        self._line.__exit__(None, None, None)
        self._process.terminate()
        self._process.wait()
        self._process.stderr.close()
        self._folder.cleanup()
        return False

    def do(self, method, **parameters):
        """One command of the protocol: its result."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            said = json.loads(self._socket.recv(timeout=60))
            if said.get("id") == self._number:
                if "error" in said:
                    raise RuntimeError(f"{method}: {said['error']}")
                return said["result"]
            if "method" in said:
                self.events.append(said)

    def js(self, expression):
        """The value of an expression in the page."""
        found = self.do("Runtime.evaluate", expression=expression, returnByValue=True,
                        awaitPromise=True)  # fmt: skip
        if "exceptionDetails" in found:
            raise RuntimeError(f"{expression}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def until(self, expression, seconds=30):
        """Wait until it is true; AssertionError says what it was."""
        end = time.monotonic() + seconds
        while not (value := self.js(expression)):
            assert time.monotonic() < end, f"not within {seconds} s: {expression} is {value!r}"
            time.sleep(0.05)
        return value

    def click(self, text):
        """Click the visible button or tab with this text."""
        place = self.until(
            "(() => { for (const e of document.querySelectorAll('button, .q-tab')) {"
            f"if (e.innerText.trim().toLowerCase() === {text.lower()!r} && e.offsetParent) {{"
            "e.scrollIntoView({block: 'center'}); const r = e.getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]; } } return null; })()"
        )
        self.press(*place)

    def press(self, x, y):
        """Mouse down and up."""
        for kind in ("mousePressed", "mouseReleased"):
            self.do("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def key(self, name, code=None, text=None):
        """One key."""
        extra = {"text": text} if text else {}
        for kind in ("keyDown", "keyUp"):
            self.do("Input.dispatchKeyEvent", type=kind, key=name, code=code or name,
                    windowsVirtualKeyCode={"Enter": 13, " ": 32, "ArrowRight": 39,
                                           "ArrowLeft": 37}.get(name, 0), **extra)  # fmt: skip

    def picture(self, path):
        """A screenshot."""
        data = self.do("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(data))

    def requested(self):
        """Every address that the page has asked for."""
        return [
            event["params"]["request"]["url"] for event in self.events
            if event["method"] == "Network.requestWillBeSent"
        ]  # fmt: skip
