"""What a level of very many objects costs: measure, and write docs/size.md.

python -m occlusion_bake.bench.size [SECTION...] [--models DIR]
"""

from __future__ import annotations

from ...addon.cli.hard_exit import run_and_exit
from ..pages import Page
from . import load, objects, reach

PAGE = Page("size", "docs/size.md", (objects, load, reach))

if __name__ == "__main__":
    run_and_exit(PAGE.run)
