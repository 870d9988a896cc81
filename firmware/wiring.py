# SPDX-License-Identifier: MIT
"""How an App's parts are joined, at its start and whenever a knob changes them while they run.

Nothing here stops the outputs: where the ticks go on they predict, and where they stand still the
gap is bridged afterwards. A new filter begins where the old one stands.
"""

import time

from attitude.counts import GYRO_LSB_PER_DPS
from attitude.standing import of_angles
from attitude.tilt import accel_tilt_deg
from micropython import const

from firmware import filters, settings
from firmware.faults.mend import Mend
from firmware.learning import Learning
from firmware.loop import Loop
from firmware.tick import judge

_LONG_TICK_US = const(750)  # python -m tools.loop.quad prints step_max_us
_LEAD_US = const(60)  # before a burst is needed it has to be on the bus for its time and this
_CORRECT_TIMER = const(5)  # looks at the sensor's clock, a fifth of a second each
_CORRECT_EDGES = const(1)
_UNKNOWN_US = const(5000000)  # in which the bias of another part is learned, roughly
_GUARD_US = const(50000)
_LEVEL_US = const(1500000)  # after a filter that may stand wrong
_STILL_MDPS = const(3000)
_RIGHT_DEG = const(1.5)
_SWAP_MS = const(30)  # two periods at the lowest rate, and a little
_NO = (0.0, 0.0, 0.0)

# places: firmware.tick.words
_ODD = const(0)
_AGE_US = const(3)
_STALE_US = const(5)
_RING_US = const(7)
_SWAP = const(10)
_TICKS = const(5)  # of firmware.tick.timing
_UNSURE_US = const(16)
_YAW_LOST = const(17)
_FROM_US = const(15)
_LIMIT = const(22)
_PAUSE = const(24)
_PATIENCE = const(27)
_YAW_DOUBT = const(28)
_UNCERTAIN = const(12)  # of firmware.tick.estimate


def adopt_sensor(app, known):
    """The app's `imu` is there: its bus is shared from now on. known: firmware.learning's."""
    app.imu.lock = app.bus
    if app.imu.split:  # it waits for a burst under way, whoever's it is
        app.bus.finish = app.imu.finish
    app.mend = Mend(app.imu, app.board, app.bus, app.tick.words, app.other_part)
    learn(app, known)


def learn(app, known):
    """The calibration follows this part's temperature and rests; known: firmware.learning."""
    app.learning = Learning(
        app.calibration,
        known,
        app.imu,
        app.tick.words,
        app.config.still_dps,
        app.recalibrate,
        app.rested,
    )


def settle(app):
    """What knobs tell the tick."""
    words, config = app.tick.words, app.config
    words[_STALE_US] = config.failsafe_ms * 1000
    words[_RING_US] = 1000000 // config.dlpf_hz
    words[_PATIENCE] = patience = max(2, config.failsafe_ms * config.rate_hz // 1000)
    words[_LIMIT] = min(config.output_failures, patience)
    # a slower sensor's bursts come again
    repeats = 10 + 3 * config.rate_hz // config.sensor_hz
    judge.allow(app.tick.memory, repeats, config.gyro_dps, config.rate_hz)
    app.telemetry.set_rate(config.telemetry_hz, config.rate_hz)
    app.telemetry.set_format(config.telemetry_format)


def wire(app, old, new):
    """The loop and the tick for the app's knobs, with a filter `new` that goes on from `old`."""
    config, board = app.config, app.board
    on_timer = config.drive == "timer"
    timed = filters.is_timed(config.filter)
    guarded = not on_timer or board.has_spare_timer
    bus, mask = app.bus, app.tick.mask
    hard = not timed and board.has_hard(on_timer)
    hard_timer = hard and board.has_hard(True)
    if hard and not hard_timer and bus.soft & ~mask:
        hard = False  # another App's soft ticks on this bus do not hold it
    split = on_timer and config.burst != "blocking" and app.imu.split
    lead_us = _lead_us(config, board) if split else 0
    if board.wait(split):
        app.imu.use_bus(board.i2c())
    app.tick_kind = "hard" if hard else "soft"
    bus.hard = bus.hard | mask if hard else bus.hard & ~mask
    bus.soft = bus.soft & ~mask if hard else bus.soft | mask
    rate_hz = _rate_hz(app)
    readers = app.loop.readers if app.loop else []
    app.loop = Loop(
        app.tick,
        board.ticking(board.timer if on_timer else board.data_ready, hard),
        rate_hz,
        grid=on_timer,
        lead_us=lead_us,
        guard=board.ticking(board.timer, hard_timer) if guarded else None,
        guard_us=min(_GUARD_US, 333 * config.failsafe_ms) if on_timer else 0,
        guards=_guards(app, 3) if hard else None,
        masked=hard and not hard_timer,
    )
    app.loop.readers = readers
    app.period_us = app.loop.period_us
    go_on(app, old, new)
    among_hard = not hard and (board.has_hard(True) or bus.hard)
    app.tick.wire(app.imu, app.bus, app.loop.period_us, timed, lead_us, among_hard)
    app.foreground.wire(rate_hz, _CORRECT_TIMER if on_timer else _CORRECT_EDGES)
    app.outputs.tune(app.loop.period_us)


def _rate_hz(app):
    return app.config.rate_hz if app.config.drive == "timer" else app.imu.rate_hz


def _period_us(app):
    return round(1000000 / _rate_hz(app))


def made(app):
    """The filter for the app's knobs and a loop of its own, which is yet to be wired."""
    return filters.make(app.config, app.calibration, app.imu, 1e6 / _period_us(app))


def _lead_us(config, board):
    """How long before a tick its burst begins; a whole period: in the tick before, which may then
    be long. A begin that has to wait for the end of a tick would come too late for the next."""
    lead_us = board.burst_us(board.bus_hz) + _LEAD_US
    period_us = round(1000000 / config.rate_hz)
    return lead_us if period_us - lead_us > _LONG_TICK_US else period_us


def _guards(app, count):
    """firmware.stack.Guards of this app, which it keeps: they take time to make."""
    from firmware.stack import Guard

    while len(app.guards) < count:
        app.guards.append(Guard())
    return app.guards


def begin_anew(app):
    """A filter whose bias is unknown, from the attitude that is there, which is not claimed for
    some time; nor is the yaw, until somebody says zero_yaw()."""
    words = app.tick.words
    new = filters.make(app.config, app.calibration, app.imu, 1e6 / app.period_us)
    stands = app.filter.standing()
    if stands:
        new.begin_at((stands[0], stands[1], (0.0, 0.0, 0.0), None))
    use(app, new)
    words[_UNSURE_US] = _UNKNOWN_US
    words[_YAW_LOST] = words[_ODD] = 1
    words[_YAW_DOUBT] = 180000


def renew(app):
    """A filter of the app's knobs goes on from where the one of now stands."""
    new = filters.make(app.config, app.calibration, app.imu, 1e6 / app.period_us)
    go_on(app, app.filter, new)


def go_on(app, old, new):
    """`new`, which goes on from where `old` (None: nowhere) stands now, is what the tick works
    with from now on."""
    words = app.tick.words
    try:
        if old is not None:
            age_us = _pause(app)  # the old one does not move while it is looked at
            gap = app.tick.gap
            if not age_us:  # what comes until the next sample is bridged from here
                gap.open(old, app.tick.memory)
            new.go_on_from(old)
            if new.knows_yaw and not old.knows_yaw and not _stands_right(old.out):
                words[_UNSURE_US] = max(words[_UNSURE_US], _LEVEL_US)
                app.tick.est[_UNCERTAIN] |= 1  # until the next tick says it
            was, now = GYRO_LSB_PER_DPS[old.gyro_dps], GYRO_LSB_PER_DPS[new.gyro_dps]
            gap.rescale(app.tick.memory, was, now, new.accel_g / old.accel_g)
        use(app, new)
        if old is not None:
            words[_FROM_US] = age_us  # ticks of the pause are still to be bridged
    finally:  # also after a Ctrl-C
        words[_PAUSE] = 0


def _stands_right(out):
    """Whether a filter of roll and pitch is sure to be right: in a turn it is not, nor just after
    one."""
    still = max([abs(rate) for rate in out[3:6]]) < _STILL_MDPS
    told = accel_tilt_deg(*out[6:9])
    return still and max([abs(told[i] - out[i] / 1000) for i in (0, 1)]) < _RIGHT_DEG


def _pause(app):
    """From now on ticks leave the filter alone; the age up to which it stands."""
    words, timing = app.tick.words, app.tick.timing.words
    while True:
        tick, age_us = timing[_TICKS], words[_AGE_US]
        words[_PAUSE] = words[_ODD] = 1
        if timing[_TICKS] == tick:
            return age_us
        words[_PAUSE] = 0  # a tick has come in between


def use(app, new):
    """The tick works with this filter from now on."""
    app.filter = new
    app.tick.use(new)
    app.tick.words[_ODD] = 1
    filters.use(app.tick.mask, app.config.filter)


def begin_at(filter, accel_g, yaw_deg=0.0):
    """The filter stands as at a rest: the bias is that of its calibration."""
    roll, pitch = accel_tilt_deg(*accel_g)
    filter.begin_at((of_angles(roll, pitch, yaw_deg), _NO, _NO, _NO))


def rested(app, calibration):
    """A rest has shown another bias of the gyro: the filter goes on from there, its yaw stays."""
    imu, old = app.imu, app.filter
    app.calibration = calibration
    new = filters.make(app.config, app.calibration, app.imu, 1e6 / app.period_us)
    begin_at(new, calibration.apply(imu.accel_g(), _NO)[0], old.yaw_mdeg / 1000)
    if hasattr(new, "learn_from"):
        new.learn_from(old)
    use(app, new)


def change(app, pace):
    """Set-up knobs have changed: the chip, the coefficients, and with `pace` the ticks.

    The rest is not measured again.
    """
    config, imu, words = app.config, app.imu, app.tick.words
    running = app.loop.running
    with app.bus:
        was = imu.gyro_range_dps, imu.accel_range_g, imu.dlpf_hz, imu.rate_hz
        try:
            settings.set_up(imu, config)
            period_us = _period_us(app) if pace else app.period_us
            new = filters.make(config, app.calibration, imu, 1e6 / period_us)
        except BaseException:  # no room for it, say: the old one goes on, and its samples
            imu.set_up(*was)
            raise
        if pace:
            app.tidy()
            app.loop.stop()
            app.bus.forget(app.tick.mask)
            wire(app, app.filter, new)
        else:
            go_on(app, app.filter, new)
        settle(app)
        words[_ODD] = 1
    if pace and running:
        app.loop.start()


def revive(app):
    """The timer of the ticks has died: another one; what was missed is a gap like others."""
    app.tick.words[_ODD] = 1
    app.loop.revive()
    print("the timer of the ticks has died: another one is started")


def prepare(app, **what):
    """New coefficients, taken over between two ticks; the filter's state stays."""
    words = app.tick.words
    hard = app.loop.running and app.tick_kind == "hard"
    began = time.ticks_ms()
    while hard and words[_SWAP] and time.ticks_diff(time.ticks_ms(), began) < _SWAP_MS:
        time.sleep_us(100)  # the last ones are still to be taken over
    app.filter.prepare(**what)
    if hard:
        words[_SWAP] = words[_ODD] = 1
    else:
        app.filter.swap()


def follow(app, period_us):
    """The ticks come every period_us, as measured: so shall the filter have it."""
    app.period_us = period_us
    try:
        prepare(app, period_us=period_us)
    except ValueError:  # further off than its coefficients reach: one made for it
        renew(app)
    app.outputs.tune(period_us)
