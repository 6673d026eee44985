"""Baking under OCIO configurations of a studio's own, whose spaces have other names; each in a Blender of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import occlusion_bake  # noqa: E402
from occlusion_bake.addon.colour_space import Decoding, decoding_of, make_data, usual_spaces  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import pixels, press, select, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")

SRGB = "!<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0]}"
# Linear Rec.709 to ACEScg, rounded; each row sums up to 1, so that white and greys stay.
TO_ACESCG = "!<MatrixTransform> {matrix: [0.61, 0.34, 0.05, 0, 0.07, 0.92, 0.01, 0, 0.02, 0.11, 0.87, 0, 0, 0, 0, 1]}"


def configuration(linear: str, texture: str, data: str, primaries: str) -> str:
    """An OCIO configuration of three spaces. primaries: what makes the texture's the linear ones, after the curve."""
    curve = f"!<GroupTransform> {{children: [{', '.join(filter(None, (SRGB, primaries)))}]}}"
    roles = dict.fromkeys(("default", "data"), data)
    roles |= dict.fromkeys(("reference", "scene_linear", "rendering", "default_float", "aces_interchange"), linear)
    roles |= dict.fromkeys(("default_byte", "default_sequencer", "color_picking", "texture_paint"), texture)
    roles |= dict.fromkeys(("matte_paint", "compositing_log"), texture)
    return "\n".join(
        [
            "ocio_profile_version: 2",
            "roles:",
            *(f"  {role}: {space}" for role, space in roles.items()),
            "file_rules: [!<Rule> {name: Default, colorspace: default}]",
            "displays:",
            f"  Screen: [!<View> {{name: Plain, colorspace: {texture}}}]",
            "colorspaces:",
            f"  - !<ColorSpace> {{name: {linear}, isdata: false}}",
            f"  - !<ColorSpace> {{name: {texture}, isdata: false, to_scene_reference: {curve}}}",
            f"  - !<ColorSpace> {{name: {data}, isdata: true}}",
        ]
    )


CONFIGURATIONS = {
    "plain": configuration("Linear Rec.709 (sRGB)", "sRGB - Texture", "Raw", ""),
    "ACES": configuration("ACES - ACEScg", "Utility - sRGB - Texture", "Utility - Raw", TO_ACESCG),
}


def bake(folder: Path) -> dict[str, Any]:
    """A wall's AO on a floor, packed and then into a file, beside the values; and what materials read of images."""
    blender.wall()
    select(blender.plane("Floor"))
    set_panel(width=32, height=32, quality="RAYS", rays=16, margin=2, path=str(folder / "{object}_{map}"))
    assert press() == {"FINISHED"}
    np.save(folder / "packed.npy", pixels("Floor AO"))
    set_panel(output="SAVED", format="PNG", depth="16", use_dither=False)
    assert press() == {"FINISHED"}
    return {"usual": usual_spaces(), "AO": bpy.data.images["Floor AO"].colorspace_settings.name, **read_by_materials()}


def read_by_materials() -> dict[str, Any]:
    """Of bytes of grey and of red: what decodes them, and the number that a material's lookup starts from."""
    from occlusion_bake.addon.materials.image_pixels import ImagePixels, Unreadable

    found = {}
    for name, colour in (("grey", (0.6, 0.6, 0.6, 1.0)), ("red", (0.6, 0.0, 0.0, 1.0))):
        image = bpy.data.images.new(name, 1, 1)
        image.pixels.foreach_set(colour)
        try:
            found[name] = [decoding_of(image).value, float(ImagePixels().colour(image)[0, 0, 0])]
        except Unreadable as refusal:
            found[name] = [str(refusal), refusal.cure]
    return found


def under(configuration: str, folder: Path) -> dict[str, Any]:
    """What `bake` tells in a Blender under a configuration."""
    (folder / "config.ocio").write_text(configuration)
    environment = {**os.environ, "OCIO": str(folder / "config.ocio")}
    environment["PYTHONPATH"] = str(Path(occlusion_bake.__path__[0]).absolute().parent)
    child = subprocess.run([sys.executable, __file__, str(folder)], env=environment, capture_output=True, text=True)
    assert (folder / "told.json").is_file(), child.stderr
    told: dict[str, Any] = json.loads((folder / "told.json").read_text())
    return told


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_the_values_do_not_depend_on_the_configuration(name: str, registered: None, tmp_path: Path) -> None:
    """Materials read grey as Cycles does: what is known for sRGB decoded after the lookup, all else before."""
    told = under(CONFIGURATIONS[name], tmp_path)
    texture, data = told["usual"]
    assert told["AO"] == data and "Raw" in data and "sRGB" in texture
    packed = np.load(tmp_path / "packed.npy")
    blender.wall()
    select(blender.plane("Floor"))
    set_panel(width=32, height=32, quality="RAYS", rays=16, margin=2)
    assert press() == {"FINISHED"}
    np.testing.assert_array_equal(packed, pixels("Floor AO"))
    assert np.abs(read_image(tmp_path / "Floor_ao.png")[0][..., 0] - packed[..., 0]).max() <= 0.5001 / 65535
    linear = ((0.6 + 0.055) / 1.055) ** 2.4
    if name == "ACES":
        assert told["grey"] == ["other", pytest.approx(linear, abs=1e-6)]
        assert told["red"] == [f"the colour of red in {texture}", f"set the image's colour space to {data}"]
    else:
        assert told["grey"] == ["sRGB", pytest.approx(0.6)] and told["red"] == told["grey"]


@pytest.mark.parametrize(
    ("space", "decoding"),
    [
        ("Non-Color", Decoding.NONE),
        ("Linear Rec.709", Decoding.NONE),
        ("sRGB", Decoding.SRGB),
        ("AgX Base sRGB", Decoding.OTHER),  # whose greys are off sRGB's by 3e-4 below white
        ("Display P3", Decoding.OTHER),  # of the same curve
        ("Linear Rec.2020", Decoding.OTHER),
    ],
)
def test_spaces_are_told_by_what_they_do(space: str, decoding: Decoding) -> None:
    before = len(bpy.data.images)
    image = bpy.data.images.new("Any", 1, 1)
    image.colorspace_settings.name = space
    assert decoding_of(image) == decoding
    of_greys = {"Display P3": Decoding.SRGB, "Linear Rec.2020": Decoding.NONE}
    assert decoding_of(image, grey=True) == of_greys.get(space, decoding)
    make_data(image)
    assert image.colorspace_settings.is_data and decoding_of(image) == Decoding.NONE
    assert len(bpy.data.images) == before + 1


if __name__ == "__main__":
    from occlusion_bake.addon.cli.hard_exit import leave

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    occlusion_bake.register()
    Path(sys.argv[1], "told.json").write_text(json.dumps(bake(Path(sys.argv[1]))))
    leave(0)
