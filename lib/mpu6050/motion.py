# SPDX-License-Identifier: MIT
"""Little power: wake up on motion, and the accelerometer-only cycle. MPU6050 proper only.

    motion.enable(imu, duration_ms=1)   # INT becomes active when it is moved, and stays so
    imu.cycle(5)                        # 20 uA; each sample counts as one ms of motion
    ... sleep, woken by INT; on an ESP32 from deep sleep, which starts main.py anew:
    if motion.woke(i2c):                # before MPU6050(), which resets the chip
    imu = MPU6050(i2c, attach=True)     # or go on without a reset

The relatives of the MPU-6500 have other engines for both, at other registers.
"""

import time

from micropython import const

_ACCEL_CONFIG = const(0x1C)  # ACCEL_HPF [2:0]
_MOT_THR = const(0x1F)  # 32 mg a step
_MOT_DUR = const(0x20)  # 1 ms a step
_INT_PIN_CFG = const(0x37)  # INT_LEVEL [7], INT_OPEN [6], LATCH_INT_EN [5], INT_RD_CLEAR [4]
_INT_ENABLE = const(0x38)  # MOT_EN [6], DATA_RDY_EN [0]
_INT_STATUS = const(0x3A)  # MOT_INT [6]; reading clears all
_MOT_DETECT_CTRL = const(0x69)  # ACCEL_ON_DELAY [5:4], MOT_COUNT [1:0]
_PWR_MGMT_1 = const(0x6B)  # CYCLE [5], TEMP_DIS [3]
_PWR_MGMT_2 = const(0x6C)  # LP_WAKE_CTRL [7:6], STBY_XG YG ZG [2:0]

_WAKE_HZ = (1.25, 5, 20, 40)


def enable(imu, threshold_mg=64, duration_ms=10, active_low=None):
    """INT becomes active when an axis moves by more than threshold_mg for duration_ms, and stays
    so until moved() or woke() is asked; fresh samples are no longer signalled.

    threshold_mg 32 to 8160 in steps of 32, duration_ms 1 to 255. active_low: open drain, needs a
    pull-up; None: as it was. ValueError, OSError.
    """
    _genuine(imu)
    steps = round(threshold_mg / 32)
    if not 1 <= steps <= 255 or not 1 <= duration_ms <= 255:
        raise ValueError("threshold_mg: 32 to 8160, duration_ms: 1 to 255")
    imu.set_bits(_MOT_THR, steps, 0xFF)
    imu.set_bits(_MOT_DUR, duration_ms, 0xFF)
    imu.set_bits(_MOT_DETECT_CTRL, 0x10, 0x33)
    # latched, and cleared by a read of INT_STATUS alone: a look at a register must not undo it
    imu.set_bits(_INT_PIN_CFG, 0x20, 0x30)
    if active_low is not None:
        imu.set_bits(_INT_PIN_CFG, 0xC0 if active_low else 0, 0xC0)
    # 5 Hz high-pass; 0 would compare with nothing and never trigger
    imu.set_bits(_ACCEL_CONFIG, 0x01, 0x07)
    time.sleep_ms(100)
    imu.set_bits(_INT_ENABLE, 0x40, 0xFF)
    moved(imu)  # whatever was before


def disable(imu):
    """No motion interrupt any more. OSError."""
    imu.set_bits(_INT_ENABLE, 0, 0x40)
    imu.set_bits(_ACCEL_CONFIG, 0, 0x07)


def moved(imu):
    """True when the motion interrupt has come since the last call. OSError."""
    byte = bytearray(1)
    imu.load(_INT_STATUS, byte)
    return bool(byte[0] & 0x40)


def woke(i2c, address=0x68):
    """The same without a driver, for a board that INT has just woken: whether the chip saw motion.
    INT is idle again. OSError.
    """
    byte = bytearray(1)
    i2c.readfrom_mem_into(address, _INT_STATUS, byte)
    return bool(byte[0] & 0x40)


def cycle(imu, hz):
    """Sleep and take hz = 1.25, 5, 20 or 40 accelerometer samples a second (RM p. 42).

    The gyro and the thermometer are off; imu.wake() ends it. ValueError, OSError.
    """
    _genuine(imu)
    if hz not in _WAKE_HZ:
        raise ValueError("hz=%s: choose one of %s" % (hz, _WAKE_HZ))
    imu.set_bits(_PWR_MGMT_2, _WAKE_HZ.index(hz) << 6 | 0x07, 0xFF)
    # CLKSEL 0: the gyro's clock stops with the gyro
    imu.set_bits(_PWR_MGMT_1, 0x28, 0x6F)


def _genuine(imu):
    if not imu.profile.motion:
        raise ValueError("not on this part (%s)" % imu.profile.name)
