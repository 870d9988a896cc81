# SPDX-License-Identifier: MIT
"""The page's server without a browser: who is let in, what is kept, the slower chart, steps."""

import asyncio
import shutil

import numpy as np
import pytest

from tools.link.history import History
from tools.link.reader import Batch
from tools.scope import assets, step
from tools.scope.guard import Guard
from tools.scope.plot import rows


def asked(kind, **headers):
    """What a server behind the Guard at port 8000 answers: a status, or what a websocket gets."""
    said = []

    async def inner(scope, receive, send):
        if scope["type"] == "http":
            await send({"type": "http.response.start", "status": 200, "headers": []})
            await send({"type": "http.response.body", "body": b"page"})
        else:
            await send({"type": "websocket.accept"})

    async def send(message):
        said.append(message)

    scope = {
        "type": kind, "method": "GET", "path": "/", "query_string": b"",
        "headers": [(name.encode(), value.encode()) for name, value in headers.items()],
    }  # fmt: skip
    asyncio.run(Guard(inner, 8000)(scope, None, send))
    return said[0].get("status") if kind == "http" else said[0]["type"]


OWN = {"host": "127.0.0.1:8000"}
FOREIGN = [
    {"host": "evil.example"}, {"host": "127.0.0.1:8001"}, {},
    {"host": "127.0.0.1.evil.example:8000"},
    {**OWN, "origin": "http://evil.example"}, {**OWN, "origin": "null"},
    {**OWN, "origin": "https://127.0.0.1:8000"}, {**OWN, "origin": "http://127.0.0.1:9999"},
]  # fmt: skip


@pytest.mark.parametrize("headers", [OWN, {"host": "localhost:8000"},
                                     {**OWN, "origin": "http://localhost:8000"}])  # fmt: skip
def test_this_machine_is_let_in(headers):
    assert asked("http", **headers) == 200
    assert asked("websocket", **headers) == "websocket.accept"


@pytest.mark.parametrize("headers", FOREIGN)
def test_a_foreign_host_or_origin_is_refused(headers):
    assert asked("http", **headers) in (400, 403)
    assert asked("websocket", **headers) == "websocket.close"


def batch(first, n, header, t0=0):
    number = np.arange(first, first + n)
    raw = np.tile(number[:, None] % 1000, (1, 10)).astype(np.int16)
    return Batch(header, number, t0 + number * 4000, np.zeros(n, np.uint8), raw)


def header(**settings):
    from tools.track import COUNTS

    channels = [(name, "u", 0.5) for name in (*COUNTS, "roll", "pitch", "yaw")]
    return {"channels": channels, "period_us": 4000, "every": 1, "lag_s": 0.005,
            "settings": {"a": 1, **settings}, "calibration": {}}  # fmt: skip


def test_the_history_keeps_the_newest_in_its_room_and_marks_changes():
    history, head = History(capacity=1000), header()
    for first in range(0, 5000, 100):
        history.add(batch(first, 100, head))
    end, t, values, gap = history.since(0, ["roll"])
    assert end == 5000 and len(t) == 1000 and not gap.any()
    assert t[-1] == pytest.approx(4999 * 0.004) and values[-1, 0] == 499.5
    history.add(batch(5010, 10, header(a=2)))
    assert history.since(5000, ["roll"])[3].tolist() == [True] + 9 * [False]
    assert history.marks == [(pytest.approx(5010 * 0.004), {"a": (1, 2)})]


def test_a_reset_board_goes_on_behind_a_gap():
    history, head = History(), header()
    history.add(batch(0, 100, head))
    history.add(batch(0, 50, head))  # began anew
    _, t, _, gap = history.since(0, ["roll"])
    assert len(t) == 150 and (np.diff(t) > 0).all() and gap.nonzero()[0].tolist() == [100]


def test_a_gap_is_sent_as_a_row_without_values():
    import base64

    t, values = np.array([1.0, 1.004, 2.0]), np.array([[1.0], [2.0], [3.0]])
    t0, text = rows(t, values, np.array([False, False, True]), 0.004)
    sent = np.frombuffer(base64.b64decode(text), np.float32).reshape(-1, 2)
    assert t0 == 1.0 and len(sent) == 4
    assert np.isnan(sent[2, 1]) and sent[2, 0] == pytest.approx(1.0 - 0.004)
    assert not np.isnan(sent[[0, 1, 3], 1]).any()


def test_without_npm_the_page_has_a_slower_chart(monkeypatch, tmp_path):
    monkeypatch.setenv("PLUMB_CACHE", str(tmp_path))
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert assets.uplot() is None
    from nicegui import ui

    from tools.scope.plot import SlowPlot, plot

    with ui.card():
        made = plot("Angles", [{"label": "roll"}, {"label": "what if"}])
    assert isinstance(made, SlowPlot)
    t = np.arange(1000) / 250
    for _ in range(5):
        made.push(t, np.sin(t)[:, None], np.zeros(1000, bool), 0.004)
        t = t + 4
    assert len(made.options["series"][0]["data"]) > 100


def test_a_second_order_step_is_measured():
    """Damping 0.3, 2 Hz: overshoot exp(-pi 0.3 / sqrt(1 - 0.09)) of the step."""
    t = np.arange(0, 6, 0.004)
    w, z = 2 * np.pi * 2, 0.3
    damped = w * np.sqrt(1 - z * z)
    since = np.maximum(t - 1, 0)
    wave = np.cos(damped * since) + z / np.sqrt(1 - z * z) * np.sin(damped * since)
    way = 1 - np.exp(-z * w * since) * wave
    found = step.response(t, 5 + 10 * way)
    assert [found["from"], found["to"]] == pytest.approx([5, 15], abs=0.01)
    assert found["overshoot"] == pytest.approx(np.exp(-np.pi * z / np.sqrt(1 - z * z)), abs=0.005)
    assert 0.08 < found["rise_s"] < 0.12 and 0.6 < found["settling_s"] < 0.95
    with pytest.raises(ValueError, match="no step"):
        step.response(t, np.random.default_rng(1).normal(size=len(t)))
