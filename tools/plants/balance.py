# SPDX-License-Identifier: MIT
"""A self-balancing robot: an inverted pendulum on two wheels with real gear motors.

x: place of the axle (m, forward), p: lean (rad, forward positive), T: torque of both motors.

    (M + m + J/r^2) x'' + (m l cos(p) - J/r) p'' - m l sin(p) p'^2 = T / r
    (m l cos(p) - J/r) x'' + (I + m l^2 + J) p'' - m g l sin(p) = -T
    T = 2 (Ts u - Ts / w0 (x'/r - p')) less dry friction,   u: voltage applied / supply, -1..1

M: wheels with their inertia, m: body, J: both rotors as felt behind their gears. Body 1.1 kg with
its centre 8 cm above the axle (battery on top), wheels of 80 mm and 30 g, motors of the 37 mm
class with 30:1 gears at 12 V: stall torque 1.4 N m, no-load 330 turns a minute, rotor 0.8 g m^2
behind the gears, dry friction 0.03 N m each. Equations by Lagrange's method; the tests check them
by energy.
The sensor sits on the body `height_m` above the axle and feels what accelerates it there.
"""

import math

from tools.plants.plant import Plant, Pulses
from tools.virtual.motion import quaternions as quat

_G = 9.80665
_DEG = math.pi / 180


class Robot:
    """State and equations: x, v, p, q (lean rate, rad/s)."""

    BODY_KG = 1.1
    LENGTH_M = 0.08
    INERTIA = 0.006  # of the body about its own centre, kg m^2
    WHEEL_M = 0.04
    WHEELS_KG = 2 * (0.03 + 0.5 * 0.03)  # solid discs: their inertia counts as half their mass
    STALL_NM = 1.4
    NO_LOAD = 330 * 2 * math.pi / 60
    DRY_NM = 0.03
    ROTORS = 2 * 0.8e-3

    def __init__(self, lean_deg=0.0):
        self.x = self.v = self.q = 0.0
        self.p = lean_deg * _DEG
        self.x_acc = self.p_acc = 0.0

    def torque(self, drive):
        """Both motors at -1..1 of the supply, N m."""
        slip = self.v / self.WHEEL_M - self.q
        torque = 2 * self.STALL_NM * (drive - slip / self.NO_LOAD)
        dry = 2 * self.DRY_NM
        if abs(slip) > 0.05:
            return torque - math.copysign(dry, slip)
        return torque - math.copysign(min(dry, abs(torque)), torque)

    def accelerations(self, torque, forced=None):
        """(x'', p'') from the two equations; a hand that leads p leaves only the first."""
        m, length = self.BODY_KG, self.LENGTH_M
        c, s = math.cos(self.p), math.sin(self.p)
        rotors, r = self.ROTORS, self.WHEEL_M
        a11, a12 = self.WHEELS_KG + m + rotors / r**2, m * length * c - rotors / r
        a22 = self.INERTIA + m * length * length + rotors
        b1 = torque / r + m * length * s * self.q * self.q
        if forced is not None:
            return (b1 - a12 * forced) / a11, forced
        b2 = -torque + m * _G * length * s
        det = a11 * a22 - a12 * a12
        return (b1 * a22 - a12 * b2) / det, (a11 * b2 - a12 * b1) / det

    def step(self, drive, dt_s, forced=None):
        """Symplectic Euler, as short as the plant's step."""
        self.x_acc, self.p_acc = self.accelerations(self.torque(drive), forced)
        self.v += self.x_acc * dt_s
        self.q += self.p_acc * dt_s
        self.x += self.v * dt_s
        self.p += self.q * dt_s


class Balance(Plant):
    """The robot on four PWM pins (left forward, left back, right forward, right back).

    It is held upright until hold_s. push (time s, angle deg, length s): a hand then tilts it to
    this lean within this time, whatever the motors do, and lets go.
    """

    columns = ("x_m", "speed_m_s", "lean_deg", "drive")

    def __init__(self, port, pins, hold_s=1.8, push=(8.0, 10.0, 0.06), height_m=0.05):
        super().__init__()
        self.robot = Robot()
        self._pulses = [Pulses(port, pin) for pin in pins]
        self._hold = hold_s
        self._push = push
        self._height = height_m
        self._grip = 0.0

    def let_go(self, t_s):
        """It is held no longer than this."""
        self._hold = min(self._hold, t_s)

    @property
    def fallen(self):
        """Leaning by more than 45 degrees."""
        return abs(self.robot.p) > 45 * _DEG

    def _step(self, t_s, dt_s):
        robot = self.robot
        left, left_back, right, right_back = (p.duty(t_s) for p in self._pulses)
        drive = (left - left_back + right - right_back) / 2
        if t_s < self._hold:
            drive = 0.0
        elif self.fallen:
            robot.v = robot.q = robot.x_acc = robot.p_acc = 0.0
        else:
            robot.step(drive, dt_s, self._hand(t_s))
        self._feel()
        return robot.x, robot.v, robot.p / _DEG, drive

    def _hand(self, t_s):
        """The lean's acceleration that a hand enforces now, rad/s^2, or None: bang, bang."""
        at, angle_deg, length = self._push
        since = t_s - at
        if not 0 <= since < length:
            return None
        if since < self.STEP_S:
            self._grip = 4 * (angle_deg * _DEG - self.robot.p) / length**2
            self.robot.q = 0.0
        return self._grip if since < length / 2 else -self._grip

    def _feel(self):
        robot, h = self.robot, self._height
        c, s = math.cos(robot.p), math.sin(robot.p)
        forward = robot.x_acc + h * (c * robot.p_acc - s * robot.q**2)
        up = -h * (s * robot.p_acc + c * robot.q**2) + _G
        self.sample = ((c * forward - s * up) / _G, 0.0, (s * forward + c * up) / _G,
                       0.0, robot.q / _DEG, 0.0)  # fmt: skip
        self.quaternion = quat.from_euler(0.0, robot.p / _DEG)
