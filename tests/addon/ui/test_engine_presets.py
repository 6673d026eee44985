"""The presets for engines: they fit the panel, and their pages say the same."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

import pytest

pytest.importorskip("bpy")

from occlusion_bake.addon.ui.engine_presets import PRESETS, EnginePreset, panel_settings
from occlusion_bake.addon.ui.properties import OcclusionBakeSettings
from occlusion_bake.core.finish.image_file import check_format
from occlusion_bake.core.maps.registry import MAPS

PAGES = Path(__file__).parents[3] / "docs" / "engines"

each_preset = pytest.mark.parametrize("preset", PRESETS, ids=lambda preset: preset.name)


def page_of(preset: EnginePreset) -> str:
    return (PAGES / f"{preset.name}.md").read_text(encoding="utf-8")


def first_line(page: str) -> str:
    """That of the preset, to its full stop, without what is bold."""
    found = re.search(r"^Preset: .*?\.$", page, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[0].replace("**", "").replace("\n", " ")


@each_preset
def test_its_page_says_what_it_writes(preset: EnginePreset) -> None:
    said = first_line(page_of(preset))
    assert said.startswith(f"Preset: {preset.label} (`{preset.name}`)")
    if preset.ao is None:
        assert "no files" in said
    else:
        assert f"{preset.ao.format.upper()} of {preset.ao.depth} bits in `textures/`" in said
        assert ("AO in alpha" in said) == (preset.bent is not None and preset.bent.alpha)
    if preset.bent is None:
        assert "no bent normals" in said
    else:
        assert f"{preset.bent.space.lower()} space, Y {preset.bent.y.lower()}" in said


@each_preset
def test_its_page_names_its_files_and_the_packed_channel(preset: EnginePreset) -> None:
    page = page_of(preset)
    assert f"*Output > To > A Channel*, the image, *{preset.packed}*" in page
    for picture, kind in ((preset.ao, "ao"), (preset.bent.file if preset.bent else None, "bent")):
        if picture is not None:
            name = PurePosixPath(picture.path).name.format(object="NAME", map=kind)
            assert f"`{name}.{picture.format}`" in page


@each_preset
def test_its_page_tells_what_to_do_and_of_which_versions(preset: EnginePreset) -> None:
    page = page_of(preset)
    for part in ("| texture | where | settings |", "If it looks wrong:", "Versions:"):
        assert part in page


def test_the_index_has_every_page_and_no_other() -> None:
    index = (PAGES / "README.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\((\w+\.md)\)", index))
    assert linked == {f"{preset.name}.md" for preset in PRESETS}
    assert linked == {path.name for path in PAGES.glob("*.md")} - {"README.md"}


@each_preset
@pytest.mark.parametrize("packed", [False, True])
def test_it_sets_what_the_panel_has(preset: EnginePreset, packed: bool) -> None:
    assert panel_settings(preset, packed=packed).keys() <= OcclusionBakeSettings.__annotations__.keys()


@each_preset
def test_its_files_can_be_written_and_do_not_meet(preset: EnginePreset) -> None:
    chosen: dict[str, Any] = panel_settings(preset)
    if chosen["output"] != "SAVED":
        return
    check_format(chosen["format"].lower(), int(chosen["depth"]))
    assert preset.bent is None or preset.bent.file == preset.ao  # the panel has one path and one format
    paths = {chosen["path"].format(object=name, map=kind) for name in ("Rock", "Tree") for kind in ("ao", "bent")}
    assert len(paths) == 4


@each_preset
def test_a_packed_channel_takes_ao_alone(preset: EnginePreset) -> None:
    chosen = panel_settings(preset, packed=True)
    assert chosen["use_ao"] and chosen["output"] == "CHANNEL" and chosen["channel"] == preset.packed
    switches = {entry.switch for entry in MAPS if entry.switch} | {"use_light"}
    assert not any(chosen[name] for name in switches - {"use_ao"})


def test_what_a_preset_says_is_what_it_sets() -> None:
    godot = next(preset for preset in PRESETS if preset.name == "godot")
    assert godot.bent is not None
    turned = panel_settings(replace(godot, bent=replace(godot.bent, y="DOWN", space="WORLD", alpha=True)))
    assert (turned["bent_y"], turned["bent_space"], turned["bent_alpha"]) == ("DOWN", "WORLD", True)
    assert not panel_settings(replace(godot, bent=None))["use_bent"]
    assert panel_settings(replace(godot, ao=None))["use_gltf"] and not panel_settings(godot)["use_gltf"]
