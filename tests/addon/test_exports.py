"""The presets for engines and their pages say the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy")

from occlusion_bake.addon.exports import EXPORTS, panel_settings
from occlusion_bake.addon.settings import OcclusionBakeSettings

PAGES = Path(__file__).parents[2] / "docs" / "engines"


@pytest.mark.parametrize("export", EXPORTS, ids=lambda each: each.name)
def test_each_preset_has_a_page_that_names_it(export: Any) -> None:
    page = (PAGES / f"{export.name}.md").read_text(encoding="utf-8")
    assert f"Preset: **{export.label}** (`{export.name}`)" in page
    assert f"*{export.packed}*" in page or export.name == "three_js"
    if export.bent is not None:
        assert f"Y {export.bent.y.lower()}" in page.replace("**", "") and f"{export.bent.space.lower()} space" in page
    assert f"{export.name}.md" in (PAGES / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("export", EXPORTS, ids=lambda each: each.name)
def test_presets_set_what_the_panel_has(export: Any) -> None:
    for packed in (False, True):
        assert panel_settings(export, packed=packed).keys() <= OcclusionBakeSettings.__annotations__.keys()
