"""`make figures`: measure what the project promises and write docs/figures.md.

python -m occlusion_bake.bench.figures [SECTION...] [--rounds N] [--models DIR]
"""

from __future__ import annotations

from ...addon.cli.hard_exit import run_and_exit
from ..pages import Page
from . import charts, choices, errors, memory, props, share, sizes, speed

PAGE = Page("figures", "docs/figures.md", (speed, sizes, share, choices, errors, memory, props, charts))

if __name__ == "__main__":
    run_and_exit(PAGE.run)
