"""The presets for engines: they fit the panel, and their pages say the same."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy")

from occlusion_bake.addon.ui.engine_presets import EXPORTS, Export, panel_settings
from occlusion_bake.addon.ui.properties import OcclusionBakeSettings
from occlusion_bake.core.finish.image_file import check_format

PAGES = Path(__file__).parents[3] / "docs" / "engines"

each_preset = pytest.mark.parametrize("export", EXPORTS, ids=lambda export: export.name)


def page_of(export: Export) -> str:
    return (PAGES / f"{export.name}.md").read_text(encoding="utf-8")


def first_line(page: str) -> str:
    """That of the preset, to its full stop, without what is bold."""
    found = re.search(r"^Preset: .*?\.$", page, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[0].replace("**", "").replace("\n", " ")


@each_preset
def test_its_page_says_what_it_writes(export: Export) -> None:
    said = first_line(page_of(export))
    assert said.startswith(f"Preset: {export.label} (`{export.name}`)")
    if export.ao is None:
        assert "no files" in said
    else:
        assert f"{export.ao.format.upper()} of {export.ao.depth} bits in `textures/`" in said
        assert ("AO in alpha" in said) == (export.bent is not None and export.bent.alpha)
    if export.bent is None:
        assert "no bent normals" in said
    else:
        assert f"{export.bent.space.lower()} space, Y {export.bent.y.lower()}" in said


@each_preset
def test_its_page_names_its_files_and_the_packed_channel(export: Export) -> None:
    page = page_of(export)
    assert f"*Output > To > A Channel*, the image, *{export.packed}*" in page
    for picture, kind in ((export.ao, "ao"), (export.bent.picture if export.bent else None, "bent")):
        if picture is not None:
            name = Path(picture.path).name.format(object="NAME", map=kind)
            assert f"`{name}.{picture.format}`" in page


@each_preset
def test_its_page_tells_what_to_do_and_of_which_versions(export: Export) -> None:
    page = page_of(export)
    for part in ("| texture | where | settings |", "If it looks wrong:", "Versions:"):
        assert part in page


def test_the_index_has_every_page_and_no_other() -> None:
    index = (PAGES / "README.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\((\w+\.md)\)", index))
    assert linked == {f"{export.name}.md" for export in EXPORTS}
    assert linked == {path.name for path in PAGES.glob("*.md")} - {"README.md"}


@each_preset
@pytest.mark.parametrize("packed", [False, True])
def test_it_sets_what_the_panel_has(export: Export, packed: bool) -> None:
    assert panel_settings(export, packed=packed).keys() <= OcclusionBakeSettings.__annotations__.keys()


@each_preset
def test_its_files_can_be_written_and_do_not_meet(export: Export) -> None:
    chosen: dict[str, Any] = panel_settings(export)
    if chosen["output"] != "SAVED":
        return
    check_format(chosen["format"].lower(), int(chosen["depth"]))
    assert export.bent is None or export.bent.picture == export.ao  # the panel has one path and one format
    paths = {chosen["path"].format(object=name, map=kind) for name in ("Rock", "Tree") for kind in ("ao", "bent")}
    assert len(paths) == 4


@each_preset
def test_a_packed_channel_takes_ao_alone(export: Export) -> None:
    chosen = panel_settings(export, packed=True)
    assert chosen["use_ao"] and chosen["output"] == "CHANNEL" and chosen["channel"] == export.packed
    assert not any(chosen[name] for name in ("use_ro", "use_bent", "use_code", "use_light"))


def test_what_a_preset_says_is_what_it_sets() -> None:
    godot = next(export for export in EXPORTS if export.name == "godot")
    assert godot.bent is not None
    turned = panel_settings(replace(godot, bent=replace(godot.bent, y="DOWN", space="WORLD", alpha=True)))
    assert (turned["bent_y"], turned["bent_space"], turned["bent_alpha"]) == ("DOWN", "WORLD", True)
    assert not panel_settings(replace(godot, bent=None))["use_bent"]
    assert panel_settings(replace(godot, ao=None))["use_gltf"] and not panel_settings(godot)["use_gltf"]
