# SPDX-License-Identifier: MIT
"""`machine.PWM`, `ADC` and `WDT` of a virtual board, recorded for tests."""

from collections import deque


class VirtualReset(BaseException):
    """The board resets: `cause` is the reset cause it would report. Ends the board's program,
    whatever it catches.
    """

    def __init__(self, cause, text):
        super().__init__(text)
        self.cause = cause


class PWM:
    """Frequency in hertz and duty as on the port; every change goes to `history` as (t_ns, freq,
    duty_u16). An ESP32's begins with 5 kHz and half of the period unless it is told otherwise.
    """

    _port = None

    def __init__(self, dest, freq=None, duty_u16=None, duty_ns=None, **settings):
        self._state = self._port.pins.state(self._port.pins.number(dest))
        self._state.function, self._state.pwm = "PWM", self
        self._freq = 5000 if self._port.traits.platform == "esp32" else 0
        self._u16, self.history = 0, deque(maxlen=100_000)
        told = [duty_u16, duty_ns, settings.get("duty")]
        if self._port.traits.platform == "esp32" and told == [None, None, None]:
            self._u16 = 32768
            self._record()
        self.init(freq=freq, duty_u16=duty_u16, duty_ns=duty_ns, **settings)

    def init(self, freq=None, duty_u16=None, duty_ns=None, duty=None, invert=None):
        if duty is not None and self._port.traits.platform != "esp32":
            raise TypeError("extra keyword arguments given")
        if freq is not None:
            self.freq(freq)
        if duty is not None:
            self.duty_u16(duty * 64)
        if duty_u16 is not None:
            self.duty_u16(duty_u16)
        if duty_ns is not None:
            self.duty_ns(duty_ns)

    def freq(self, *hz):
        if not hz:
            return self._freq
        if not 8 <= hz[0] <= 62_500_000:
            raise ValueError("freq too small" if hz[0] < 8 else "freq too large")
        self._freq = int(hz[0])
        return self._record()

    def duty_u16(self, *duty):
        if not duty:
            return self._u16
        if not 0 <= duty[0] <= 65535 and self._port.traits.platform == "esp32":
            raise ValueError("duty_u16 must be from 0 to 65536")
        self._u16 = min(max(int(duty[0]), 0), 65535)
        return self._record()

    def duty_ns(self, *ns):
        if not ns:
            return self._u16 * 1_000_000_000 // (self._freq or 1) // 65535
        if self._freq == 0:
            raise ValueError("PWM frequency is not set")
        return self.duty_u16(min(65535, int(ns[0]) * self._freq * 65535 // 1_000_000_000))

    def deinit(self):
        self._u16, self._state.pwm = 0, None
        self._record()

    def _record(self):
        self.history.append((self._port.clock.now_ns, self._freq, self._u16))


class ADC:
    """Reads what `port.adc[pin]` holds (0..65535, default half)."""

    _port = None
    CORE_TEMP = 4

    def __init__(self, pin, **settings):
        self._key = pin if isinstance(pin, int) else self._port.pins.number(pin)

    def read_u16(self):
        return self._port.adc.get(self._key, 32768)

    def read_uv(self):
        return self.read_u16() * 3_300_000 // 65535


class WDT:
    """Starts at once, cannot be stopped; raises VirtualReset wherever the program is when it
    starves.
    """

    _port = None

    def __init__(self, id=0, timeout=5000):
        traits = self._port.traits
        if id != 0:
            raise ValueError("WDT(%d) doesn't exist" % id)
        if timeout > traits.wdt_max_ms:
            raise ValueError("timeout exceeds %d" % traits.wdt_max_ms)
        if timeout <= 0:
            raise ValueError("WDT timeout too short")
        if self._port.watchdog is not None:
            self._port.watchdog._event.cancel()
        self._port.watchdog = self
        self.timeout_ms, self.feeds, self._event = timeout, deque(maxlen=100_000), None
        self._start()

    def _start(self):
        clock = self._port.clock
        self._event = clock.hardware_at(clock.now_ns + self.timeout_ms * 1_000_000, self._starve)

    def feed(self):
        self._event.cancel()
        self.feeds.append(self._port.clock.now_ns)
        self._start()

    def _starve(self):
        cause = self._port.traits.reset_causes["WDT_RESET"]
        raise VirtualReset(cause, "watchdog not fed for %d ms" % self.timeout_ms)
