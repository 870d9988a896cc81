# SPDX-License-Identifier: MIT
"""The site from docs/site, strictly: a warning is an error, and nothing external is loaded.

    python -m tools.docs [--serve]      # into out/docs; --serve: on 127.0.0.1, rebuilt on change
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILT = ROOT / "out" / "docs"
# what a page loads by itself; a link that a person may follow is none
LOADED = re.compile(r"""<(?:script|img|iframe|link)[^>]*(?:src|href)=["'](https?:)?//([^"']+)""")


def build():
    """Build the site; its folder. RuntimeError with what the builder said."""
    command = [sys.executable, "-m", "zensical", "build", "--strict", "--clean"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    if done.returncode or "warning" in said.lower():
        raise RuntimeError(said.strip())
    return BUILT


def loaded(folder):
    """(page, address) of all that the pages load from elsewhere."""
    found = []
    for page in sorted(folder.rglob("*.html")):
        for line in LOADED.finditer(page.read_text()):
            if 'rel="canonical"' not in line[0]:
                found.append((page.relative_to(folder).as_posix(), line[2]))
    return found


def main():
    parser = argparse.ArgumentParser(prog="python -m tools.docs", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--serve", action="store_true")
    if parser.parse_args().serve:
        return subprocess.call([sys.executable, "-m", "zensical", "serve"], cwd=ROOT)
    try:
        folder = build()
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 1
    outside = loaded(folder)
    for page, address in outside:
        print(f"{page} loads {address}", file=sys.stderr)
    print(f"{len(list(folder.rglob('*.html')))} pages in {folder}")
    return 1 if outside else 0


if __name__ == "__main__":
    sys.exit(main())
