# SPDX-License-Identifier: MIT
"""Motors turn when they were armed, and arming is refused in words where nobody should."""

from math import cos, radians, sin

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig
from tools.virtual.faults import make
from tools.virtual.motion import Still

boards = pytest.mark.parametrize("board", BOARDS)
robots = pytest.mark.parametrize("name", ["balance", "quad"])
STOP_US = {"balance": 0, "quad": 1000}


def started(rig, name):
    """The application's module and its App, three quarters of a second later."""
    apps = __import__("firmware.apps." + name, fromlist=["start"])
    app = apps.start()
    rig.port.run_ms(750)
    return apps, app


def pulses_us(rig, since_ns=0):
    """The set of pulse lengths on the outputs since then, microseconds."""
    found = set()
    for pin in rig.app.board.outputs:
        pwm = rig.port.pin(pin).pwm
        if pwm is not None:
            for t_ns, freq, duty in pwm.history:
                if t_ns >= since_ns:
                    found.add(round(duty / 65535 * 1e6 / freq, 1))
    return found


def fly(rig, app, name):
    """Arm and turn the motors."""
    if name == "quad":
        app.quad.command(0)
        app.quad.arm()
        app.quad.command(500)
    else:
        app.balance.arm()
        rig.port.run_ms(1100)
    rig.port.run_ms(20)
    assert getattr(app, name).armed


@boards
@robots
def test_the_first_pulse_of_an_output_is_its_safe_value(board, name, tmp_path):
    with Rig(board, Still(roll_deg=0.0), tmp_path) as rig:
        started(rig, name)
        rig.port.run_ms(3000)  # a board that lies on the desk
        # no pulse at all is as good as the shortest one
        assert all(us == 0 or abs(us - STOP_US[name]) < 1 for us in pulses_us(rig))
        assert pulses_us(rig)


@robots
@pytest.mark.parametrize("why", ["stopped", "stale", "uncertain", "raising"])
def test_arming_is_refused_in_words(name, why, tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        _, app = started(rig, name)
        controller = getattr(app, name)
        if name == "quad":
            app.quad.command(0)
        if why == "stopped":
            app.stop()
        elif why == "stale":
            rig.bus.faults.append(make("nack", at_s=rig.port.now_ns / 1e9, for_s=1.0))
            rig.port.run_ms(200)
        elif why == "uncertain":
            app.tick.words[17] = app.tick.words[0] = 1  # YAW_LOST, ODD: an outage while it turned
            rig.port.run_ms(20)
            assert app.uncertain
        else:
            app.outputs.add(lambda app: 1 // 0, hard=True)
            rig.port.run_ms(20)
        before = rig.port.now_ns
        words = {"stopped": "does not run", "stale": "stale", "uncertain": "uncertain"}
        with pytest.raises(ValueError, match="not armed: .*" + words.get(why, "raises")):
            controller.arm()
        rig.port.run_ms(1500)
        assert not controller.armed
        assert all(abs(us - STOP_US[name]) < 1 for us in pulses_us(rig, before))


@pytest.mark.parametrize("axis", ["roll_deg", "pitch_deg"])
def test_a_tilted_quad_or_one_with_its_throttle_up_is_refused(axis, tmp_path):
    with Rig("hard", Still(**{axis: 35.0}), tmp_path) as rig:
        _, app = started(rig, "quad")
        app.quad.command(0)
        with pytest.raises(ValueError, match=r"tilted by 3[45]"):
            app.quad.arm()
    with Rig("hard", Still(), tmp_path) as rig:
        _, app = started(rig, "quad")
        app.quad.command(300)
        with pytest.raises(ValueError, match="throttle"):
            app.quad.arm()


def test_a_filter_without_yaw_is_refused_under_a_quad(tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        _, app = started(rig, "quad")
        app.set("filter", "kalman2")
        rig.port.run_ms(50)
        app.quad.command(0)
        with pytest.raises(ValueError, match="does not know the yaw"):
            app.quad.arm()
        app.set("filter", "attitude")
        rig.port.run_ms(50)
        app.quad.arm()
        assert app.quad.armed


def _set(name, value):
    return lambda rig, app: app.set(name, value)


def _ctrl_c(rig, app):
    def interrupted(source):
        raise KeyboardInterrupt

    made = app.imu.set_up
    app.imu.set_up = interrupted
    with pytest.raises((KeyboardInterrupt, TypeError)):
        app.set("gyro_dps", 2000)
    app.imu.set_up = made


def _raising(rig, app):
    rig.controller.control = rig.controller.pid = None


def _one_axis(rig, app):
    if app.has("quad"):
        with pytest.raises(ValueError, match="armed, and the filter kalman2 does not know"):
            app.set("filter", "kalman2")
        assert app.config.filter == "attitude"
    else:
        app.set("filter", "kalman2")


def _dead(rig, app):
    for source in app.loop._sources[:-1]:  # as by a Timer of the user's own with the same number
        source.deinit()


IN_FLIGHT = {
    "dead loop": _dead,
    "float filter": _set("filter", "float.attitude"),
    "one-axis filter": _one_axis,
    "range": _set("gyro_dps", 2000),
    "low-pass": _set("dlpf_hz", 44),
    "rate": _set("rate_hz", 500),
    "blocking": _set("burst", "blocking"),
    "gain": lambda rig, app: app.set("quad_rate_p" if app.has("quad") else "balance_kp", 1.0),
    "Ctrl-C": _ctrl_c,
    "raising": _raising,
    "stop": lambda rig, app: app.stop(),
    "clear": lambda rig, app: app.outputs.clear(),
    "unplugged": lambda rig, app: rig.bus.faults.append(
        make("nack", at_s=rig.port.now_ns / 1e9, for_s=30.0)
    ),
    "pause": lambda rig, app: rig.port.clock.hold(round(1e9)),
}


@boards
@robots
@pytest.mark.parametrize("event", IN_FLIGHT)
def test_motors_are_fed_or_safe_within_the_failsafe_whatever_happens(
    board, name, event, tmp_path, capsys
):
    """After each event the motors are commanded on, or have their safe value after 100 ms."""
    with Rig(board, Still(), tmp_path) as rig:
        _, app = started(rig, name)
        rig.controller = getattr(app, name)
        fly(rig, app, name)
        IN_FLIGHT[event](rig, app)
        for _ in range(10):
            if name == "quad" and rig.controller.armed and event != "raising":
                app.quad.command(500)
            rig.port.run_ms(20)
        since = rig.port.now_ns
        rig.port.run_ms(100)
        stopped = all(abs(us - STOP_US[name]) < 1 for us in pulses_us(rig, since))
        last = {rig.port.pin(pin).pwm.history[-1][2] for pin in app.board.outputs}
        fed = len([1 for pin in app.board.outputs
                   for t, _, _ in rig.port.pin(pin).pwm.history if t >= since])  # fmt: skip
        if event in ("stop", "clear", "unplugged", "raising"):
            assert stopped and not rig.controller.armed
            assert all(abs(duty - STOP_US[name] * 65535 * 400 / 1e6) < 30 for duty in last)
        elif rig.controller.armed:
            assert fed > 10
            assert not app.stale
        else:
            assert stopped
        if event == "dead loop":
            assert rig.controller.armed and not app.loop.dead
            assert "timer of the ticks has died" in capsys.readouterr().out
            assert fed >= 90 * app.config.rate_hz // 1000  # at its full rate again
        if event == "raising":
            assert type(rig.controller).__name__ + ".update" in capsys.readouterr().out


class TipOver:
    """Level until 3 s, then over to 85 degrees within half a second, about x or y."""

    duration_s = None

    def __init__(self, axis):
        self.axis = axis

    def at(self, t):
        angle = radians(85 * min(max(2 * (t - 3), 0), 1))
        rate = 170.0 if 3 <= t < 3.5 else 0.0
        if self.axis == "roll":
            return (0, sin(angle), cos(angle), rate, 0, 0, 25.0)
        return (-sin(angle), 0, cos(angle), 0, rate, 0, 25.0)

    def truth(self, t):
        return (1.0, 0, 0, 0)


@boards
@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_both_roll_and_pitch_end_a_flight(board, axis, tmp_path):
    with Rig(board, TipOver(axis), tmp_path) as rig:
        _, app = started(rig, "quad")
        fly(rig, app, "quad")
        armed = []
        while rig.port.now_ns < 3.6e9:
            app.quad.command(500)
            rig.port.run_ms(20)
            armed.append(app.quad.armed)
        assert armed[0] and not armed[-1]


@robots
def test_an_application_started_twice_is_one_and_uses_the_running_app(name, tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        rig.app.start()
        apps = __import__("firmware.apps." + name, fromlist=["start"])
        first = apps.start()
        assert first is rig.app is type(rig.app).current()
        controller = getattr(first, name)
        again = apps.start()
        assert again is first and getattr(again, name) is controller


def test_two_on_one_pin_and_two_apps_on_one_sensor_are_refused(tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        from firmware.app import App
        from firmware.apps import balance, quad

        app = balance.start()
        with pytest.raises(ValueError, match="balance already"):
            quad.start()
        assert not app.has("quad") and app.running
        second = App()
        with pytest.raises(OSError, match="running App"):
            second.start()
        assert not second.running and app.running
        rig.port.run_ms(100)
        assert not app.stale
