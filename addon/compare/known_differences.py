"""Why our AO and Cycles' may differ though all settings match: what is known, as far as it applies."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ..materials.cutouts import MaterialOpacities
from ..materials.image_pixels import ImagePixels
from ..materials.normal_maps import MaterialNormalMaps


def reasons_to_differ(
    target: bpy.types.Object,
    values: Floats,
    samples: int,
    other_owner: int,
    occluders: Collection[bpy.types.Object],
    of_our_own: Collection[str] = (),
    *,
    normal_maps: bool = False,
) -> list[str]:
    """A line for each. target: the baked object. values: (N,) float32, our AO of the compared texels. other_owner:
    texels that Cycles gives to another triangle. occluders: the objects that block light. of_our_own: settings
    that Cycles lacks. normal_maps: whether those of its materials turned its normals."""
    noise = float(np.sqrt(np.mean(values * (1.0 - values), dtype=np.float64) / samples))
    lines = [f"Noise: Cycles' {samples} samples alone may make an RMSE of up to {noise:.4f}"]
    if other_owner:
        lines.append(
            f"Edges: {other_owner} texels show another triangle in Cycles, which looks at their middle; here the one "
            "that covers most of them counts"
        )
    if bpy.app.version < (5, 0):
        lines.append("Footprint: Cycles before Blender 5 samples the middle half of a texel, here the whole of it")
    lines += [f"Settings: {what}, which Cycles' bake has not" for what in of_our_own]
    pixels = ImagePixels()
    lines += _of_normals(target, MaterialNormalMaps(pixels=pixels), normal_maps=normal_maps)
    opacities = MaterialOpacities(pixels=pixels)
    for material in _materials(occluders):
        opacities.of(material, lines)
    if any(opacities.of(material, []).alpha is not None for material in _materials([target])):
        lines.append("Transparency: Cycles multiplies AO by the surface's own opacity, which is baked as opaque here")
    return lines


def _of_normals(target: bpy.types.Object, normal_maps_of: MaterialNormalMaps, *, normal_maps: bool) -> list[str]:
    """On what turns the target's normals in Cycles and does not here."""
    lines: list[str] = []
    found = [normal_maps_of.of(material, lines) for material in _materials([target])]
    if any(found) and not normal_maps:
        lines += ["Normals: Cycles follows the normal map of the material; switch Normal Maps on to bake by it"]
    return lines


def _materials(objects: Collection[bpy.types.Object]) -> Iterator[bpy.types.Material]:
    for obj in objects:
        yield from (slot.material for slot in obj.material_slots if slot.material)
