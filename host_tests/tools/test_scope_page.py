# SPDX-License-Identifier: MIT
"""The live page in a real browser, before a virtual board: looked at, tuned, unplugged."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from host_tests.tools.browser_rig import Browser

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "out" / "scope"
PLOTS = "[...document.querySelectorAll('*')].filter((e) => e.scope).map((e) => e.scope)"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="module")
def server():
    """The address of a page on the virtual board, shaken."""
    port = free_port()
    alone = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
    process = subprocess.Popen(
        [sys.executable, "-m", "tools.scope", "--virtual", "--motion", "shaken",
         "--http-port", str(port), "--no-browser"],
        cwd=ROOT, stdout=subprocess.PIPE, text=True, env=alone,
    )  # fmt: skip
    try:
        said = next((line for line in process.stdout if line.startswith("page: ")), None)
        assert said == f"page: http://127.0.0.1:{port}/\n"
        yield port
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(15)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


@pytest.fixture(scope="module")
def page(server):
    PICTURES.mkdir(parents=True, exist_ok=True)
    with Browser(f"http://127.0.0.1:{server}/") as browser:
        browser.until(f"{PLOTS}.length === 2 && {PLOTS}[0].data[0].length > 500", 60)
        yield browser


def newest(page, plot=0):
    return page.js(f"{PLOTS}[{plot}].data.map((column) => column.at(-1))")


def test_traces_move_and_a_pause_holds_the_picture_while_they_go_on(page):
    before = newest(page)
    page.until(f"{PLOTS}[0].data[0].at(-1) > {before[0]} + 1")
    after = newest(page)
    assert after[1:4] != before[1:4]
    page.click("Pause")
    page.until(f"{PLOTS}[0].paused && {PLOTS}[1].paused")
    end = page.js(f"{PLOTS}[0].chart.scales.x.max")
    page.until(f"{PLOTS}[0].data[0].at(-1) > {end} + 1")
    assert page.js(f"{PLOTS}[0].chart.scales.x.max") == end
    page.click("Go on")
    page.until(f"{PLOTS}[0].chart.scales.x.max > {end} + 1")


def test_a_knob_is_changed_on_the_board_marked_and_undone(page):
    page.click("Knobs")
    field = "document.querySelector('input[aria-label=attitude_tau_s]')"
    page.until(f"{field} !== null && {field}.offsetParent !== null")
    page.js(f"{field}.focus(); {field}.select()")
    for digit in "2.5":
        page.key(digit, text=digit)
    page.key("Enter", text="\r")
    page.until("document.body.innerText.includes('*  attitude_tau_s')")
    page.until(f"{PLOTS}[0].marks.some((m) => m.text === 'attitude_tau_s')")
    page.click("Undo")
    page.until(f"{field}.value === '2.3'")
    page.click("Changes")
    page.until("document.body.innerText.includes('attitude_tau_s: 2.3 → 2.5')")
    page.until("document.body.innerText.includes('attitude_tau_s: 2.5 → 2.3')")


def test_the_past_is_tuned_within_a_second_and_graded(page):
    page.until(f"{PLOTS}[0].data[0].length > 2500", 60)
    page.click("Tune the past")
    slider = "document.querySelector('[role=slider][aria-label=attitude_tau_s] [tabindex=\"0\"]')"
    page.until(f"{slider} !== null && {slider}.offsetParent !== null")
    page.until("document.body.innerText.includes('samples again in')", 60)
    page.js(f"{slider}.focus()")
    page.until(f"document.activeElement === {slider}")
    for _ in range(5):
        page.key("ArrowRight")
        time.sleep(0.1)
    page.until("!document.body.innerText.includes('attitude_tau_s = 2.3 s')")
    page.until("document.body.innerText.includes('Distance from the best hindsight')", 30)
    page.until(f"{PLOTS}[0].data[4].some((v) => v !== null)")
    took = page.js("/again in ([0-9.]+) s/.exec(document.body.innerText)[1]")
    print(f"the past again in {took} s")
    page.picture(PICTURES / "past.png")


def test_the_visible_is_exported(page, tmp_path):
    page.do("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.click("CSV")
    page.click("PNG")
    end = time.monotonic() + 20
    while len([p for p in tmp_path.iterdir() if p.suffix in (".csv", ".png")]) < 4:
        assert time.monotonic() < end, list(tmp_path.iterdir())
        time.sleep(0.1)
    [angles] = [p for p in tmp_path.glob("*.csv") if "roll [deg]" in p.read_text()[:60]]
    lines = angles.read_text().splitlines()
    assert lines[0].startswith("t [s],roll [deg],pitch [deg],yaw [deg]")
    t = [float(line.split(",")[0]) for line in lines[1:]]
    assert len(t) > 200 and 3.0 < t[-1] - t[0] < 10.5
    assert next(tmp_path.glob("*.png")).read_bytes().startswith(b"\x89PNG")


def test_a_change_of_colours_keeps_what_is_shown(page):
    width = f"{PLOTS}[0].chart.scales.x.max - {PLOTS}[0].chart.scales.x.min"
    page.js(f"{PLOTS}[0].setShown(1, false)")
    for dark in (True, False):
        page.js(f"document.body.classList.toggle('body--dark', {str(dark).lower()})")
        page.until(f"{PLOTS}[0].dark === {str(dark).lower()}")
        assert page.js(f"({PLOTS}[0].build(), {width})") == pytest.approx(10.0, abs=0.01)
        assert page.js(f"{PLOTS}[0].chart.series[2].show") is False
    page.js(f"{PLOTS}[0].own = {PLOTS}[0].chart; document.body.classList.add('busy')")
    page.until(f"{PLOTS}[0].pushes > {page.js(f'{PLOTS}[0].pushes')} + 2")
    assert page.js(f"{PLOTS}[0].own === {PLOTS}[0].chart")  # no colour of it
    page.js(f"{PLOTS}[0].setShown(1, true); document.body.classList.remove('busy')")


def test_the_cable_is_pulled_and_put_back_and_the_gap_is_drawn(page):
    had = page.js(f"{PLOTS}[0].data[0].length")
    page.click("Unplug")
    page.until("document.body.innerText.includes('no board')")
    page.click("Plug in")
    page.until("document.body.innerText.includes('1 times away')")
    page.until(f"{PLOTS}[0].gaps.length >= 1 && {PLOTS}[1].gaps.length >= 1")
    page.until("/connected: [1-9]/.test(document.body.innerText)")
    assert page.js(f"{PLOTS}[0].data[0].length") > min(had, 4000)  # kept
    page.picture(PICTURES / "gap.png")


def test_keys_move_the_cursor_and_measure(page):
    page.js(f"{PLOTS}[0].$refs.plot.focus()")
    page.key("ArrowRight")
    page.key("m", text="m")
    for _ in range(9):
        page.key("ArrowRight")
    text = page.until(f"{PLOTS}[0].$refs.readout.textContent.includes('difference') && "
                      f"{PLOTS}[0].$refs.readout.textContent")  # fmt: skip
    assert "roll" in text and "deg" in text and not text.startswith("difference: 0.000 s")
    page.key(" ", code="Space", text=" ")
    page.until(f"!{PLOTS}[0].paused")


@pytest.mark.parametrize("tab", ["Vibration", "Body", "Step", "Auto-tune"])
def test_each_tab_opens_and_shows_what_it_is_for(page, tab):
    page.click(tab)
    said = {
        "Vibration": "/[45][0-9] Hz, [0-9]+ turns a minute/",
        "Body": "/roll +-?[0-9]/",
        "Step": "/Measure/i",
        "Auto-tune": "/Nothing is set until you say so/",
    }[tab]
    page.until(f"{said}.test(document.body.innerText)", 30)
    page.picture(PICTURES / f"{tab.lower()}.png")


def test_nothing_is_asked_from_elsewhere(page, server):
    hosts = {url.split("/")[2] for url in page.requested() if url.startswith(("http", "ws"))}
    assert hosts == {f"127.0.0.1:{server}"}


def test_it_is_dark_for_who_likes_it_dark(server):
    with Browser(f"http://127.0.0.1:{server}/", dark=True) as browser:
        browser.until(f"{PLOTS}.length === 2 && {PLOTS}[0].data[0].length > 500", 60)
        assert browser.js(f"{PLOTS}[0].paper") == "#121212"
        assert browser.js("getComputedStyle(document.body).backgroundColor") == "rgb(18, 18, 18)"
        browser.picture(PICTURES / "dark.png")


def test_frames_come_and_memory_stays(page, server):
    """A look at it for some seconds; tools of the command line measure it for ten minutes."""
    seconds = float(os.environ.get("SCOPE_SECONDS", "8"))
    before = page.js(f"{PLOTS}[0].pushes")
    fps = page.js(
        "new Promise((done) => { let n = 0; const began = performance.now();"
        "const f = () => { n++; const t = performance.now() - began;"
        f"t < {1000 * seconds} ? requestAnimationFrame(f) : done(1000 * n / t); }};"
        "requestAnimationFrame(f); })"
    )
    pushes = (page.js(f"{PLOTS}[0].pushes") - before) / seconds
    print(f"{fps:.0f} fps, {pushes:.1f} updates/s")
    assert fps > 20 and pushes > 5
