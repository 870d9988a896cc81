# SPDX-License-Identifier: MIT
"""PID, servo, ESCs and mixer: the laws by hand calculation; integer twins by the float ones."""

import itertools
import math
import random
from array import array

import pytest
from control import PID, Escs, QuadX, Servo, VelocityPID, fixed


class Pwm:
    """What machine.PWM offers to a servo."""

    def __init__(self):
        self.hz = None
        self.ns = []

    def freq(self, hz):
        self.hz = hz

    def duty_ns(self, ns):
        assert isinstance(ns, int)
        self.ns.append(ns)


# --- PID ---


def test_each_term_by_hand():
    assert PID(3.0, 0, 0).update(2.0, 0.1) == pytest.approx(6.0)
    integral = PID(0, 4.0, 0)
    assert [integral.update(2.0, 0.5) for _ in range(3)] == pytest.approx([4.0, 8.0, 12.0])
    assert PID(0, 0, 2.0).update(1.0, 0.1, rate=5.0) == pytest.approx(-10.0)
    on_error = PID(0, 0, 2.0)
    assert on_error.update(1.0, 0.1) == 0
    assert on_error.update(1.5, 0.1) == pytest.approx(10.0)


def test_a_step_of_the_target_gives_no_derivative_kick():
    pid = PID(0, 0, 2.0)
    for target in (0.0, 0.0, 50.0, 50.0):
        assert pid.update(target - 3.0, 0.01, measurement=3.0) == 0


def test_derivative_filter_is_a_first_order_lag():
    pid = PID(0, 0, 1.0, tau_d_s=0.1)
    for _ in range(1000):
        out = pid.update(0, 0.0001, rate=1.0)
    assert out == pytest.approx(-(1 - math.exp(-1)), abs=1e-3)


@pytest.mark.parametrize("make", [PID, VelocityPID])
@pytest.mark.parametrize("limit,low,high", [(10, -10, 10), ((0, 255), 0, 255)])
def test_clamped_and_no_wind_up(make, limit, low, high):
    pid = make(1.0, 5.0, 0.0, limit)
    for _ in range(10000):
        out = pid.update(100.0, 0.01)
        assert out <= high
    assert out == high
    steps = next(k for k in range(100) if pid.update(-1.0, 0.01) < high)
    assert steps <= 1
    for _ in range(10000):
        out = pid.update(-100.0, 0.01)
        assert out >= low
    assert out == low
    assert next(k for k in range(100) if pid.update(1.0, 0.01) > low) <= 1


def test_no_limit_means_no_limit():
    pid = PID(1.0, 0, 0)
    assert pid.update(1e6, 0.01) == 1e6


def test_bumpless_gains():
    pid = PID(2.0, 1.0, 0.1, limit=1000)
    for _ in range(50):
        before = pid.update(3.0, 0.01, rate=0.5)
    pid.tune(kp=8.0, ki=4.0, kd=0.3)
    after = pid.update(3.0, 0.01, rate=0.5)
    assert after - before == pytest.approx(4.0 * 3.0 * 0.01)  # one step of the new integral
    plain = PID(2.0, 0, 0)
    plain.update(3.0, 0.01)
    plain.tune(kp=8.0)
    assert plain.update(3.0, 0.01) == 24.0


def test_velocity_form_gives_the_positional_output():
    rng = random.Random(1)
    value, forms = 0.0, (PID(1.5, 2.0, 0.02), VelocityPID(1.5, 2.0, 0.02))
    forms[1].update(-value, 0.01, value)
    forms[0].update(-value, 0.01, value)
    for _ in range(200):
        value += rng.uniform(-0.1, 0.1)
        outs = [pid.update(-value, 0.01, value) for pid in forms]
        assert outs[0] == pytest.approx(outs[1], abs=1e-9)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("make", [PID, VelocityPID])
def test_an_error_that_is_no_number_holds_the_output(make, bad):
    pid = make(1.0, 1.0, 0.0, 10)
    pid.update(1.0, 0.1)
    held = pid.output
    assert pid.update(bad, 0.1) == held
    assert math.isfinite(pid.update(1.0, 0.1))
    assert math.isfinite(pid.update(1.0, 0.0))


def test_reset_starts_from_an_output():
    for make in (PID, VelocityPID):
        pid = make(1.0, 1.0, 0.0, 10)
        pid.reset(4.0)
        assert pid.update(0.0, 0.01) == 4.0
        pid.reset(40.0)
        assert pid.update(0.0, 0.01) == 10.0


def test_a_limit_the_wrong_way_round_is_refused():
    with pytest.raises(ValueError, match="low must be below high"):
        PID(1, 0, 0, limit=(5, -5))


# --- integer PID ---


@pytest.mark.parametrize(
    "gains", [(0.02, 0.05, 0.0015), (1.7, 0.0, 0.0), (0.0, 3.0, 0.0), (-0.3, -0.4, -0.01)]
)
def test_integer_pid_is_the_float_pid(gains):
    rng = random.Random(7)
    twin = fixed.PID(*gains, limit=900, rate_hz=250, input_max=180000, tau_d_s=0.01)
    real = PID(*gains, limit=900, tau_d_s=0.01)
    angle = rate = 0.0
    for _ in range(3000):
        rate = 0.98 * rate + rng.gauss(0, 400)
        angle = 0.99 * angle + rate * 0.004
        error = round(-angle)
        # one unit of output for the roundings of the terms, more where a small gain has few bits
        assert twin.update(error, round(rate)) == pytest.approx(
            real.update(error, 0.004, rate=round(rate)), abs=5
        )


def test_integer_pid_has_no_wind_up_and_tunes_without_a_jump():
    pid = fixed.PID(0.01, 0.05, 0.0, limit=100, rate_hz=100)
    for _ in range(2000):
        assert pid.update(50000) == 100
    assert [pid.update(-1000) for _ in range(2)][-1] < 100
    pid.reset(40)
    for _ in range(20):
        before = pid.update(1000)
    pid.tune(kp=0.03)
    assert abs(pid.update(1000) - before) <= 2
    pid.reset(-100000)
    assert pid.update(0) == -100


def test_integer_pid_refuses_gains_that_could_overflow():
    with pytest.raises(ValueError, match="gain 5000 too large"):
        fixed.PID(5000, 0, 0, limit=100)
    with pytest.raises(ValueError, match="limit"):
        fixed.PID(1, 0, 0, limit=1 << 20)


def test_integer_controllers_take_full_scale_for_ever():
    """Under the checked viper an intermediate result beyond int32 raises."""
    pid = fixed.PID(0.9, 3.0, 0.5, limit=(-200000, 200000), rate_hz=250, tau_d_s=0.05)
    quad = fixed.QuadControl((8.0,) * 3, ((2.0, 4.0, 0.04),) * 3, 1000)
    extremes = (-(1 << 30), -180000, -1, 0, 1, 180000, (1 << 30) - 1)
    rates = array("i", [0] * 3)
    for error, rate in itertools.product(extremes, repeat=2):
        for _ in range(20):
            assert -200000 <= pid.update(error, rate) <= 200000
    ends = (-180000, 0, 179999)
    turns = (-4_000_000, 0, 4_000_000)  # twice the widest range, mdeg/s
    for wanted, at, turn, throttle in itertools.product(ends, ends, turns, (0, 1000)):
        quad.target(wanted, wanted, wanted)
        rates[0] = rates[1] = rates[2] = turn
        for _ in range(20):
            quad.update(throttle, array("i", [at] * 3), rates)
            assert all(abs(x) <= 1000 for x in quad.torque)
            assert all(-1 <= m <= 1001 for m in quad.motors)


def test_quad_control_is_two_loops_and_a_mixer():
    """Against the same law in float: rate wanted = gain error, a PID on the rate, the mixer."""
    angle_gains, limit = (6.0, 5.0, 3.0), 200
    rate_gains = ((1.2, 0.8, 0.02), (1.1, 0.6, 0.015), (2.0, 1.0, 0.0))
    quad = fixed.QuadControl(angle_gains, rate_gains, limit, 1000, 200, tau_d_s=0.003)
    real = [PID(*gains, limit=limit, tau_d_s=0.003) for gains in rate_gains]
    mixer = QuadX()
    rng = random.Random(3)
    angle, rate, last = [0.0] * 3, [0.0] * 3, [0] * 3
    target = (10000, -20000, 179000)
    quad.target(*target)
    for _ in range(2000):
        rates = array("i", [0] * 3)
        for k in range(3):
            rate[k] = 0.999 * rate[k] + rng.gauss(0, 2)
            angle[k] += rate[k] / 1000
            rates[k] = round(rate[k] * 1000)
        mdeg = [round(a * 1000) for a in angle]
        mdeg[2] -= 180000  # the short way from -180 to 179 is -1 degree
        quad.update(550, array("i", mdeg), rates)
        expected = []
        for k in range(3):
            off = (target[k] - mdeg[k]) / 1000
            off -= 360 * round(off / 360)
            wanted = min(max(angle_gains[k] * off, -200), 200)
            measured = rates[k] / 1000
            change = rates[k] - last[k]  # mdeg/s in a millisecond are deg/s^2
            last[k] = rates[k]
            expected.append(real[k].update(wanted - measured, 0.001, rate=change))
        assert quad.torque == pytest.approx(expected, abs=4)
        motors = mixer.update(0.55, *(t / 1000 for t in quad.torque))
        assert list(quad.motors) == pytest.approx([m * 1000 for m in motors], abs=4)
        assert quad.saturated == mixer.saturated
    quad.reset()
    fresh = fixed.QuadControl(angle_gains, rate_gains, limit, 1000, 200, tau_d_s=0.003)
    fresh.target(*target)
    for control in (quad, fresh):
        control.update(550, array("i", [0] * 3), rates)
    assert quad.motors == fresh.motors


@pytest.mark.parametrize("bad", [{"limit": 2000}, {"rate_limit_dps": 600}])
def test_quad_control_refuses_what_cannot_be(bad):
    with pytest.raises(ValueError):
        fixed.QuadControl((1.0,) * 3, ((1.0, 1.0, 0.0),) * 3, **bad)


# --- mixer ---

# x forward, y left: position and spin (+1 clockwise from above) of motors 1 to 4
PLACES = ((-1, -1, 1), (1, -1, -1), (-1, 1, -1), (1, 1, 1))


def torques(motors):
    """Roll, pitch, yaw torque of four thrusts: r x F, and the drag against the spin."""
    roll = sum(y * m for (x, y, s), m in zip(PLACES, motors))
    pitch = sum(-x * m for (x, y, s), m in zip(PLACES, motors))
    yaw = sum(s * m for (x, y, s), m in zip(PLACES, motors))
    return roll / 4, pitch / 4, yaw / 4


def test_mixer_makes_the_torque_it_is_asked_for():
    motors = QuadX().update(0.5, 0.1, -0.05, 0.07)
    assert sum(motors) / 4 == pytest.approx(0.5)
    assert torques(motors) == pytest.approx((0.1, -0.05, 0.07))


@pytest.mark.parametrize("throttle", [0.0, 0.1, 0.5, 0.95, 1.0])
def test_saturated_mixer_keeps_roll_and_pitch_and_their_direction(throttle):
    rng = random.Random(2)
    mixer = QuadX()
    for _ in range(500):
        wanted = [rng.uniform(-0.6, 0.6) for _ in range(3)]
        motors = list(mixer.update(throttle, *wanted))
        assert all(0 <= m <= 1 for m in motors)
        roll, pitch, yaw = torques(motors)
        scale = min(1.0, 0.5 / (abs(wanted[0]) + abs(wanted[1])))
        assert (roll, pitch) == pytest.approx((wanted[0] * scale, wanted[1] * scale), abs=1e-9)
        assert abs(yaw) <= abs(wanted[2]) + 1e-9 and yaw * wanted[2] >= -1e-12
        if not mixer.saturated:
            assert yaw == pytest.approx(wanted[2])


def test_mixer_spans_the_full_range_when_yaw_is_all_there_is():
    assert torques(QuadX().update(0.5, 0, 0, 2.0)) == pytest.approx((0, 0, 0.5))


# --- servo and ESC ---


def test_servo_pulses_by_calibration():
    pwm = Pwm()
    servo = Servo(pwm, pulse_us=(900, 2100), angle_deg=(-60, 60))
    assert pwm.hz == 50
    for angle, pulse_us in ((-60, 900), (0, 1500), (60, 2100), (30, 1800)):
        assert servo.write(angle * 1000) == angle * 1000
        assert pwm.ns[-1] == pytest.approx(pulse_us * 1000, abs=500)
    assert servo.write(90000) == 60000
    assert pwm.ns[-1] == pytest.approx(2100e3, abs=500)


def test_servo_turned_round_and_off_centre():
    pwm = Pwm()
    servo = Servo(pwm, pulse_us=(1000, 2000), angle_deg=(80, -10))
    for angle, pulse_us in ((80, 1000), (-10, 2000), (35, 1500)):
        servo.write(angle * 1000)
        assert pwm.ns[-1] == pytest.approx(pulse_us * 1000, abs=500)


def test_servo_slew_limit_and_release():
    pwm = Pwm()
    servo = Servo(pwm, slew_dps=100, rate_hz=50)
    assert servo.write(-40000) == -40000  # where it starts is not known: no slew
    assert [servo.write(0) for _ in range(3)] == [-38000, -36000, -34000]
    servo.release()
    assert pwm.ns[-1] == 0
    assert servo.write(10000) == 10000


@pytest.mark.parametrize("bad", [{"angle_deg": (5, 5)}, {"pulse_us": (2000, 1000)}])
def test_servo_refuses_nonsense(bad):
    with pytest.raises(ValueError):
        Servo(Pwm(), **bad)


def test_escs_stay_stopped_until_armed_and_stop_when_safe():
    pwms = [Pwm() for _ in range(4)]
    escs = Escs(pwms)
    escs.write(array("i", [500] * 4))
    assert {p.ns[-1] for p in pwms} == {1000000}
    with pytest.raises(ValueError, match="throttle 10"):
        escs.arm(10)
    with pytest.raises(ValueError, match="tilted by 40"):
        escs.arm(0, 40000)
    escs.arm(0)
    escs.write(array("i", [0, 300, 700, 5000]))
    assert [p.ns[-1] for p in pwms] == [1050000, 1300000, 1700000, 2000000]
    escs.safe()
    assert {p.ns[-1] for p in pwms} == {1000000}
    escs.write(array("i", [500] * 4))
    assert {p.ns[-1] for p in pwms} == {1000000}


def test_escs_refuse_pulses_longer_than_their_period():
    with pytest.raises(ValueError, match="do not fit"):
        Escs([Pwm()], freq_hz=600)
