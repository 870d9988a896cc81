# SPDX-License-Identifier: MIT
"""What shakes the sensor: spectra, their peaks, and what a notch against each would cost.

A notch of quality Q at f delays what is far below it by 1 / (2 pi f Q). It can only stand where
its samples show the vibration: above 0.45 of the rate a peak may be an alias of another one.
"""

import numpy as np
from scipy import signal

QUALITY = 3.0
TOP = 0.45  # of the rate
LOWEST_HZ = 8.0  # what moves more slowly is motion
PROMINENCE_DB = 10.0
WORTH_G = 0.02  # a weaker vibration costs a notch more than it brings
WORTH_DPS = 0.5
SEGMENT_S = 2.0


def spectrum(values, hz):
    """(Hz, power per Hz) of three axes together."""
    size = min(len(values), int(SEGMENT_S * hz))
    found = [signal.welch(axis - np.mean(axis), hz, nperseg=size) for axis in values.T]
    return found[0][0], np.sum([power for _, power in found], axis=0)


def peaks(values, hz):
    """[(Hz, RMS in the values' unit)], the strongest first."""
    at_hz, power = spectrum(values, hz)
    decibel = 10 * np.log10(np.maximum(power, 1e-18))
    places, _ = signal.find_peaks(decibel, prominence=PROMINENCE_DB)
    step = at_hz[1]
    out = []
    for place in places:
        if at_hz[place] >= LOWEST_HZ:
            near = slice(max(0, place - 3), place + 4)
            out.append((float(at_hz[place]), float(np.sqrt(np.sum(power[near]) * step))))
    return sorted(out, key=lambda peak: -peak[1])


def delay_ms(at_hz, quality=QUALITY):
    """What a notch delays slow motion by."""
    return 1000 / (2 * np.pi * at_hz * quality)


def advice(track):
    """[{"hz", "accel_g", "gyro_dps", "notch": bool, "delay_ms", "words"}], the strongest first."""
    gyro, accel = track.units()
    hz = track.rate_hz
    shaken, turned = peaks(accel, hz), peaks(gyro, hz)
    every = {}
    for which, (found, least) in enumerate(((shaken, WORTH_G), (turned, WORTH_DPS))):
        for at_hz, size in found:
            if size >= least:
                near = next((f for f in every if abs(f - at_hz) < 1.0), at_hz)
                every.setdefault(near, [0.0, 0.0])[which] = size
    out = []
    for at_hz, (size_g, size_dps) in every.items():
        possible = at_hz <= TOP * hz
        row = {
            "hz": round(at_hz, 1), "accel_g": round(size_g, 3), "gyro_dps": round(size_dps, 2),
            "notch": possible, "delay_ms": round(delay_ms(at_hz), 2) if possible else None,
        }  # fmt: skip
        row["words"] = _words(row, hz)
        out.append(row)
    return sorted(out, key=lambda row: -(row["accel_g"] / WORTH_G + row["gyro_dps"] / WORTH_DPS))


def _words(row, hz):
    what = f"{row['hz']:.0f} Hz, {60 * row['hz']:.0f} turns a minute if it is a motor's"
    size = f"{row['accel_g']:.2f} g and {row['gyro_dps']:.1f} deg/s RMS"
    if not row["notch"]:
        return (
            f"{what}: {size}. No notch: it lies above {TOP} of the rate ({TOP * hz:.0f} Hz), "
            f"where it may be the alias of a faster one. Lower dlpf_hz, or raise rate_hz."
        )
    late = row["delay_ms"]
    return (
        f"{what}: {size}. attitude.fixed.Notch({row['hz']:.0f}, {hz:.0f}, {QUALITY:.0f}) ahead of "
        f"the filter takes it away and delays motion by {late:.2f} ms, {0.1 * late:.2f} degrees "
        f"at 100 deg/s. Softer mounting costs nothing."
    )
