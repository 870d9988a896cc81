# SPDX-License-Identifier: MIT
"""A release: what has to be right before it, and what is in its folder."""

import hashlib
import json
import sys
import zipfile

import pytest

from tools.release import __main__ as command
from tools.release.bundles import ARCHITECTURES
from tools.release.checks import NotReady, check_size, check_texts, notes, version
from tools.release.index import packages
from tools.virtual.rp2040.flash import ROOT, cross_compile


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("release")
    command.make(out, [])
    return out


def test_the_project_is_as_ready_as_its_changelog_says():
    check_texts(draft=True)


@pytest.fixture
def house(tmp_path):
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "1.2.3"\n')
    (tmp_path / "CHANGELOG.md").write_text("# Changes\n\n## 1.2.3 (2026-11-25)\n\n- all\n")
    (tmp_path / "lib" / "one").mkdir(parents=True)
    (tmp_path / "lib" / "one" / "__init__.py").write_text("")
    (tmp_path / "lib" / "one" / "package.json").write_text(
        '{\n  "urls": [\n    ["one/__init__.py", "__init__.py"]\n  ],\n  "version": "1.2.3"\n}\n'
    )
    return tmp_path


def test_what_is_ready(house):
    check_texts(draft=False, root=house)
    assert notes(house) == ("1.2.3 (2026-11-25)", "- all")


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("pyproject.toml", "1.2.3", "1.2.3b", "not of the form"),
        ("CHANGELOG.md", "1.2.3", "1.2.2", r"begins with '1\.2\.2"),
        ("CHANGELOG.md", "2026-11-25", "unreleased", "YYYY-MM-DD"),
        ("CHANGELOG.md", "- all", "", "says nothing"),
        ("CHANGELOG.md", "## ", "", "has no section"),
        ("lib/one/package.json", "1.2.3", "1.2.2", "lib/one/package.json is out of date"),
    ],
)
def test_what_is_not(house, file, old, new, said):
    text = (house / file).read_text()
    (house / file).write_text(text.replace(old, new))
    with pytest.raises(NotReady, match=said):
        check_texts(draft=False, root=house)


def test_a_file_that_is_in_no_list_is_found(house):
    (house / "lib" / "one" / "new.py").write_text("")
    with pytest.raises(NotReady, match="out of date"):
        check_texts(draft=False, root=house)


def test_what_has_outgrown_its_place_is_found(monkeypatch, tmp_path, capsys):
    with pytest.raises(NotReady, match="x: 11 bytes, at most 10"):
        check_size("x", 11, 10)
    monkeypatch.setattr(command, "BUNDLE_BYTES", 1000)
    arguments = ["release", "--draft", "--no-images", "--out", str(tmp_path / "r")]
    monkeypatch.setattr(sys, "argv", arguments)
    assert command.main() == 1
    assert "armv6m.zip" in capsys.readouterr().err


def test_each_bundle_has_the_modules_of_its_processor_and_the_starters(made):
    for architecture in ARCHITECTURES:
        with zipfile.ZipFile(made / f"plumb-{version()}-{architecture}.zip") as archive:
            names = set(archive.namelist())
            assert {"boot.py", "main.py", "README.txt", "firmware/app.mpy"} <= names
            assert not any(name.endswith(".py") for name in names - {"boot.py", "main.py"})
            source = (ROOT / "lib/attitude/fixed/biquad.py").read_bytes()
            compiled = cross_compile(source, "lib/attitude/fixed/biquad.py", architecture)
            assert archive.read("lib/attitude/fixed/biquad.mpy") == compiled


def test_the_index_has_each_library_and_the_app_by_digest(made):
    names = sorted(path.parent.name for path in (ROOT / "lib").glob("*/__init__.py"))
    for form in ("py", "6"):
        assert sorted(p.name for p in (made / "index/package" / form).iterdir()) == sorted(
            [*names, "plumb"]
        )
    listed = json.loads((made / f"index/package/py/minimu9/{version()}.json").read_text())
    assert listed["deps"] == [["mpu6050", version()]]
    for path, short in listed["hashes"]:
        data = (made / "index/file" / short[:2] / short).read_bytes()
        assert data == (ROOT / "lib" / path).read_bytes()
        assert hashlib.sha256(data).hexdigest().startswith(short)


def test_the_app_depends_on_what_it_imports():
    files, depends = packages()["plumb"]
    assert {"attitude", "calibration", "mpu6050"} <= set(depends)
    assert files["plumb_main.py"] == (ROOT / "main.py").read_bytes()
    assert "firmware/app.py" in files and "firmware/image/plumb_image.py" not in files


def test_every_file_is_in_the_sums_and_again_the_same(made, tmp_path):
    command.make(tmp_path / "again", [])
    sums = (made / "SHA256SUMS").read_text()
    assert sums == (tmp_path / "again" / "SHA256SUMS").read_text()
    listed = {line.split("  ")[1] for line in sums.splitlines()}
    there = {p.relative_to(made).as_posix() for p in made.rglob("*") if p.is_file()}
    assert there == listed | {"SHA256SUMS"}
    assert (made / "NOTES.md").read_text().startswith(f"# Plumb {version()} (")
