# SPDX-License-Identifier: MIT
"""Everything that a release offers, checked and made into one folder.

    python -m tools.release [--draft] [--no-images] [--out out/release]

| what | for whom |
|---|---|
| `plumb-V-ARCH.zip` | who copies files with Thonny or ViperIDE: .mpy for one processor, starters |
| `index/` | who installs with mip: `mpremote mip install --index URL/index plumb` |
| `plumb-V-BOARD-....uf2` | who wants it frozen in (tools.image) |
| `SHA256SUMS`, `NOTES.md` | who checks; what is new |

mip cannot tell processors apart, so its packages are .py; their viper code is then compiled on the
board. The same inputs give the same bytes.
"""
