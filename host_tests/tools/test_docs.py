# SPDX-License-Identifier: MIT
"""The site builds without a warning and loads nothing; every Python block of it and of the README
runs on the virtual board."""

import re
from pathlib import Path

import pytest

from tools import docs, figures
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still
from tools.virtual.port import Port

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "docs" / "site"
OTHERS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob(".github/**/*.md")]
PAGES = {p.relative_to(ROOT).as_posix(): p for p in [*OTHERS, *SITE.rglob("*.md")]}
BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)


def blocks(path):
    return BLOCK.findall(path.read_text())


@pytest.mark.parametrize("name", [name for name, path in PAGES.items() if blocks(path)])
def test_every_python_block_runs_in_the_order_of_its_page(name, tmp_path, monkeypatch):
    """As at the REPL that main.py leaves: with `app` and `imu`, the loop running."""
    monkeypatch.chdir(tmp_path)
    if name.endswith("virtual.md"):  # a program for the PC
        for block in blocks(PAGES[name]):
            exec(block, {"__name__": "__main__"})
        return
    chip = MPU6050Chip(Still(), seed=3, gyro_bias_dps=(1.0, -2.0, 0.5))
    with Port("rp2", {0: Bus(chip)}, wiring={0: (4, 5)}, version=(1, 26, 1)) as port:
        from firmware.app import App

        app = App()
        app.start()
        port.run_ms(500)
        repl = {"__name__": "__main__", "app": app, "imu": app.imu}
        for block in blocks(PAGES[name]):
            port.exec(block, repl)
            port.run_ms(300)
        assert port.errors == [] and app.foreground.error is None and app.tick.error is None
        app.stop()


def test_the_site_builds_strictly_and_loads_nothing_from_elsewhere():
    folder = docs.build()
    assert docs.loaded(folder) == []
    for page in SITE.rglob("*.md"):
        built = folder / page.relative_to(SITE).with_suffix(".html")
        assert built.exists(), page
    assert "zero_yaw" in (folder / "api" / "app.html").read_text()


def test_what_a_page_would_load_is_seen(tmp_path):
    (tmp_path / "a.html").write_text('<script src="https://example.org/x.js"></script>')
    assert docs.loaded(tmp_path) == [("a.html", "example.org/x.js")]


def test_the_readme_is_a_page():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


def test_the_table_of_faults_is_the_firmwares():
    section = f"<!-- policy -->\n{figures.policy()}\n<!-- end policy -->"
    text = (SITE / "faults.md").read_text()
    assert section in text
    assert "| `timeout` | the bus does not move (ETIMEDOUT) | recover |" in text


def test_every_command_named_exists():
    """make targets and `python -m tools...` of all pages."""
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    for path in PAGES.values():
        text = path.read_text()
        assert set(re.findall(r"(?:^    |`|^)make ([a-z-]+)", text, re.M)) <= targets, path
        for module in re.findall(r"python -m (tools[\w.]*)", text):
            place = ROOT / module.replace(".", "/")
            assert place.with_suffix(".py").exists() or (place / "__main__.py").exists(), module


def test_every_file_and_folder_named_exists():
    named = re.compile(r"`((?:lib|firmware|host_tests|tools|docs)/[\w/.]*)`")
    for path in PAGES.values():
        for name in named.findall(path.read_text()):
            assert (ROOT / name).exists(), (path, name)


def test_what_names_a_version_names_the_projects():
    project = (ROOT / "pyproject.toml").read_text()
    [ruff] = re.findall(r"ruff==[\d.]+", (ROOT / ".pre-commit-config.yaml").read_text())
    assert f'"{ruff}"' in project
    [version] = re.findall(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(), re.M)
    assert f'version = "{version}"' in project


def test_the_wiring_tables_are_the_same():
    readme = (ROOT / "README.md").read_text()
    table = re.search(r"^\| MPU6050 \(GY-521\).*?\n\n", readme, re.M | re.S)
    assert table[0] in (SITE / "wiring.md").read_text()
