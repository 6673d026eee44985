"""Why our AO and Cycles' may differ though all settings match: what is known, as far as it applies."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ..materials.cutouts import MaterialOpacities
from ..materials.displacement import MaterialDisplacements, lines_on_movers
from ..materials.image_pixels import ImagePixels
from ..materials.normal_maps import MaterialNormalMaps
from ..read.displacement import lines_on_subdivision
from ..typed import mesh_of


def reasons_to_differ(
    surfaces: Collection[bpy.types.Object],
    values: Floats,
    samples: int,
    occluders: Collection[bpy.types.Object],
    of_this_bake: Collection[str] = (),
    *,
    highs: Collection[bpy.types.Object] = (),
    normal_maps: bool = False,
) -> list[str]:
    """A line for each. surfaces: the objects that are seen in the image. values: (N,) float32, our AO of the compared
    texels. occluders: the objects that block light. of_this_bake: lines on what else is known. highs: of the surfaces
    those that are seen from low meshes. normal_maps: whether those of the others' materials turned their normals."""
    noise = float(np.sqrt(np.mean(values * (1.0 - values), dtype=np.float64) / samples))
    lines = [f"Noise: Cycles' {samples} samples alone may make an RMSE of up to {noise:.4f}"]
    if bpy.app.version < (5, 0):
        if any(_is_smooth_in_parts(obj) for obj in surfaces):
            lines.append(
                "Normals: Cycles before Blender 5 bends smooth faces at their edges to flat ones, too; here they look "
                "as Blender shows them"
            )
        lines.append("Footprint: Cycles before Blender 5 samples the middle half of a texel, here the whole of it")
    lines += of_this_bake
    pixels = ImagePixels()
    own = [obj for obj in surfaces if obj not in highs]
    lines += _of_normals(own, highs, MaterialNormalMaps(pixels=pixels), normal_maps=normal_maps)
    lines += _of_displacement([*surfaces, *occluders])
    opacities = MaterialOpacities(pixels=pixels)
    for material in _materials(occluders):
        opacities.of(material, lines)
    if any(opacities.of(material, []).alpha is not None for material in _materials(surfaces)):
        lines.append("Transparency: Cycles multiplies AO by the surface's own opacity, which is baked as opaque here")
    return lines


def _is_smooth_in_parts(obj: bpy.types.Object) -> bool:
    mesh = mesh_of(obj)
    smooth = np.empty(len(mesh.polygons), dtype=np.bool_)
    mesh.polygons.foreach_get("use_smooth", smooth)
    return bool(smooth.any() and not smooth.all() and not mesh.has_custom_normals)


def _of_normals(
    own: Collection[bpy.types.Object],
    highs: Collection[bpy.types.Object],
    normal_maps_of: MaterialNormalMaps,
    *,
    normal_maps: bool,
) -> list[str]:
    """On what turns their normals in Cycles and does not here. own: the surfaces that are no high meshes."""
    lines: list[str] = []
    mapped, high_mapped = (
        [normal_maps_of.of(material, lines) for material in _materials(objects)] for objects in (own, highs)
    )
    if any(mapped) and not normal_maps:
        lines += ["Normals: Cycles follows the normal map of the material; switch Normal Maps on to bake by it"]
    if any(high_mapped):
        lines += ["Normals: Cycles follows the normal map of a high mesh's material; here high meshes have their own"]
    return lines


def _of_displacement(objects: Collection[bpy.types.Object]) -> list[str]:
    """On what Cycles displaces otherwise."""
    found = MaterialDisplacements()
    moved = {obj: movers for obj in objects if (movers := found.movers(obj))}
    lines = lines_on_movers((obj.name, movers) for obj, movers in moved.items())
    return lines + [line for obj in moved for line in lines_on_subdivision(obj.name, obj, bpy.context.scene)]


def _materials(objects: Collection[bpy.types.Object]) -> Iterator[bpy.types.Material]:
    for obj in objects:
        yield from (slot.material for slot in obj.material_slots if slot.material)
