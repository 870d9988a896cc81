# SPDX-License-Identifier: MIT
"""One HTML file with all that tuning found, pictures in it; it needs no network."""

import base64
import html
import io

import numpy as np

from tools.replay import engine, grade
from tools.tune import noise, vibration

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;
color:#1a1a1a;background:#fff}
table{border-collapse:collapse}td,th{border:1px solid #bbb;padding:.25rem .6rem;text-align:left}
img{max-width:100%}pre{background:#eee;padding:.7rem;overflow:auto}
@media(prefers-color-scheme:dark){body{color:#e6e6e6;background:#161616}pre{background:#2a2a2a}
img{filter:invert(.88) hue-rotate(180deg)}}
"""


def write(path, tracks, figures, lines):
    """The report of tools.tune's figures."""
    parts = [f"<h1>Tuning of {html.escape(', '.join(figures['files']))}</h1>"]
    parts.append("<h2>What to set</h2><pre>" + html.escape("\n".join(lines)) + "</pre>")
    parts.append(_table(
        ("filter", "proposed", "error before", "after", "against"),
        [(name, ", ".join(f"{k} = {v:g}" for k, v in row["changed"].items()) or "defaults stay",
          f"{row['rms_unchanged_deg']:.3f} deg", f"{row['rms_deg']:.3f} deg", row["against"])
         for name, row in figures["filters"].items()],
    ))  # fmt: skip
    for track in tracks:
        parts.append(f"<h2>{html.escape(track.name)}</h2>")
        parts.append(_picture(_grade, track, figures))
        parts.append(_picture(_spectrum, track, figures))
        words = [row["words"] for row in figures["vibration"][track.name][:5]]
        parts.append("".join(f"<p>{html.escape(text)}</p>" for text in words or ["No vibration."]))
        if figures["noise"][track.name]:
            parts.append(_picture(_allan, track, figures))
    rows = [(name, html.escape(str(value))) for name, value in figures["settings"].items()]
    parts.append("<h2>All settings</h2>" + _table(("knob", "value"), rows))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Tuning</title>"
        f"<style>{_STYLE}</style><body>{''.join(parts)}</body></html>\n"
    )


def _table(head, rows):
    cells = "".join(f"<th>{text}</th>" for text in head)
    body = "".join("<tr>" + "".join(f"<td>{c}</td>" for c in row) + "</tr>" for row in rows)
    return f"<table><tr>{cells}</tr>{body}</table>"


def _picture(make, track, figures):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axis = plt.subplots(figsize=(10, 3.6), layout="constrained")
    text = make(axis, track, figures)
    data = io.BytesIO()
    figure.savefig(data, dpi=100)
    plt.close(figure)
    picture = base64.b64encode(data.getvalue()).decode()
    return f"<img alt='{html.escape(text)}' src='data:image/png;base64,{picture}'>"


def _grade(axis, track, figures):
    up, _, against = grade.reference(track)
    for label, changes, style in (
        ("before", {"filter": figures["settings"]["filter"]}, ":"),
        ("proposed", {"filter": figures["settings"]["filter"], **figures["changed"]}, "-"),
    ):
        angles = engine.run(track, engine.changed(track.settings, changes))
        axis.plot(track.t_s, grade.errors_deg(angles, up), style, label=label, linewidth=1)
    axis.set(xlabel="s", ylabel=f"error against {against}, degrees")
    axis.legend()
    return "tilt error over time, before and after"


def _spectrum(axis, track, _):
    gyro, accel = track.units()
    for values, unit, style in ((gyro, "gyro, (deg/s)^2/Hz", "-"), (accel, "accel, g^2/Hz", "--")):
        hz, power = vibration.spectrum(values, track.rate_hz)
        axis.semilogy(hz, power, style, label=unit, linewidth=1)
    axis.axvspan(vibration.TOP * track.rate_hz, track.rate_hz / 2, alpha=0.15, color="gray")
    axis.set(xlabel="Hz (grey: no notch can stand there)")
    axis.legend()
    return "spectrum of gyro and accelerometer"


def _allan(axis, track, _):
    still = track.part(noise.rest(track))
    for name, calibration, style in (("raw", {}, ":"), ("used", still.calibration, "-")):
        piece = track.part(noise.rest(track))
        piece.calibration = calibration
        for at, rate in zip("xyz", piece.units()[0].T):
            taus, deviation = noise.allan(rate, track.rate_hz)
            axis.loglog(taus, np.maximum(deviation, 1e-9), style, label=f"{at}, {name}")
    axis.set(xlabel="s", ylabel="Allan deviation of the gyro, deg/s")
    axis.legend(ncols=2)
    return "Allan deviation of the gyro at rest"
