# SPDX-License-Identifier: MIT
"""What has to be right before anything is made: version, changelog, package lists, sizes."""

import re
import tomllib

from tools.packages import manifest
from tools.virtual.rp2040.flash import ROOT

IMAGE_BYTES = 256 * 1024  # that the app may add to an image: a Pico has room for 300 KB
# of .mpy: twice it, a deploy's copy beside what runs, leaves a third of the smallest flash,
# 848 KiB. Heap is dearer: code that is native or in files of its own is longer here, shorter there
BUNDLE_BYTES = 280 * 1024


class NotReady(Exception):
    """What is wrong, a line for each."""


def version(root=ROOT):
    """The one that pyproject.toml names."""
    return tomllib.loads((root / "pyproject.toml").read_text())["project"]["version"]


def notes(root=ROOT):
    """(heading, text) of the changelog's first section."""
    parts = re.split(r"^## (.*)$", (root / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    if len(parts) < 3:
        raise NotReady("CHANGELOG.md has no section")
    return parts[1].strip(), parts[2].strip()


def check_texts(draft, root=ROOT):
    """NotReady unless the changelog tells of this version and the package lists are whole.

    draft: the changelog may still say "unreleased" in place of a day.
    """
    wrong = []
    number = version(root)
    if not re.fullmatch(r"\d+\.\d+\.\d+", number):
        wrong.append(f"pyproject.toml: version {number} is not of the form 1.2.3")
    heading, text = notes(root)
    day = r"(unreleased|\d{4}-\d\d-\d\d)" if draft else r"\d{4}-\d\d-\d\d"
    if not re.fullmatch(rf"{re.escape(number)} \({day}\)", heading):
        wrong.append(f"CHANGELOG.md begins with '{heading}', not with '{number} (YYYY-MM-DD)'")
    if not text:
        wrong.append("CHANGELOG.md says nothing of it")
    for init in sorted((root / "lib").glob("*/__init__.py")):
        listed = init.parent / "package.json"
        if not listed.exists() or listed.read_text() != manifest(init.parent, number):
            wrong.append(f"{listed.relative_to(root)} is out of date: python -m tools.packages")
    if wrong:
        raise NotReady("\n".join(wrong))


def check_size(what, size, limit):
    """NotReady when something has outgrown its place."""
    if size > limit:
        raise NotReady(f"{what}: {size} bytes, at most {limit}")
