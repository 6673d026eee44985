"""`make accuracy`: measure how right the bake is and write docs/accuracy.md; hard writes docs/hard_cases.md.

python -m occlusion_bake.bench.accuracy [SECTION...] [--models DIR]
"""

from __future__ import annotations

from ...addon.cli.hard_exit import run_and_exit
from ..pages import Page
from . import cycles, exact, fuzz, horizon, kinds, second

PAGE = Page("accuracy", "docs/accuracy.md", (exact, second, cycles, kinds, horizon, fuzz))

if __name__ == "__main__":
    run_and_exit(PAGE.run)
