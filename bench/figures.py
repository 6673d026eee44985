"""`make figures`: measure what the project promises and write docs/figures.md.

python -m occlusion_bake.bench.figures [SECTION...] [--rounds N] [--models DIR]
"""

from __future__ import annotations

import sys

from ..addon.cli.hard_exit import leave
from ..core.base.version import version
from . import agreement, charting, choices, memory, share, speed
from .pages import Page

PAGE = Page(
    module="occlusion_bake.bench.figures",
    path="docs/figures.md",
    title="Figures",
    about=f"Occlusion Bake {version()}. Written by `make figures`; one section alone: `.venv/bin/python -m "
    "occlusion_bake.bench.figures SECTION`. Times are wall-clock medians of alternating runs.",
    sections={
        "speed": (speed.measure, speed.page),
        "agreement": (agreement.measure, agreement.page),
        "share": (share.measure, share.page),
        "choices": (choices.measure, choices.page),
        "memory": (memory.measure, memory.page),
        "charts": (charting.measure, charting.page),
    },
)

if __name__ == "__main__":
    leave(PAGE.run(sys.argv[1:]))
