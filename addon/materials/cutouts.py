"""Which of an object's triangles let light through, and how: its materials' opacity, laid over it by its UV maps."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.base.arrays import Ints
from ...core.scene.cutout import OPAQUE, Alpha, Cutout, simplified
from ...core.scene.image_texture import Wrap
from .image_pixels import ImagePixels, Unreadable
from .material_cache import MaterialCache
from .mesh_layers import materials_of, places_of, slots_of
from .opacity import opacity_of
from .texel_values import Lookup, TexelValues


@dataclass(frozen=True, eq=False)
class MaterialOpacity:
    """What a material does to the light. alpha: None for an opaque one. lookup: None where it is the same all over."""

    alpha: Alpha | None = None
    lookup: Lookup | None = None


class MaterialOpacities(MaterialCache[MaterialOpacity]):
    """The materials' covers; each image is read once, each texture made once."""

    def __init__(self, override: bpy.types.Material | None = None, pixels: ImagePixels | None = None) -> None:
        super().__init__(override, pixels)
        self._alphas: dict[tuple[int, bool, Wrap], Alpha] = {}  # by the address of the values, which they keep

    def _nothing(self) -> MaterialOpacity:
        return MaterialOpacity()

    def _read(self, material: bpy.types.Material, lines: list[str]) -> MaterialOpacity:
        try:
            opacity = opacity_of(material, self._pixels)
        except Unreadable as unread:
            what, cure = unread.in_words("alpha"), unread.cure or "bake its opacity into an image, and use that"
            lines.append(f"{material.name}: {what}; it blocks light as if opaque; {cure}")
            return MaterialOpacity()
        if opacity.note:
            lines.append(f"{material.name}: {opacity.note}")
        return MaterialOpacity() if opacity.texels.is_all(1.0) else self._cover(opacity.texels)

    def _cover(self, texels: TexelValues) -> MaterialOpacity:
        values = np.ascontiguousarray(texels.values, dtype=np.float32)
        key = (id(values), *texels.sampling)
        if key not in self._alphas:
            self._alphas[key] = Alpha(values, *texels.sampling)
        alpha = self._alphas[key]
        return MaterialOpacity() if alpha.opaque else MaterialOpacity(alpha, texels.lookup)


def cutout_of(
    obj: bpy.types.Object, mesh: bpy.types.Mesh, corners: Ints, triangle_polygons: Ints, opacities: MaterialOpacities
) -> tuple[Cutout | None, list[str]]:
    """What cuts an evaluated object's mesh, None where nothing does, and lines on materials that are met first here and
    not read as they are.

    corners: (T, 3) int32 corners of the mesh, triangle_polygons: (T,) int32, as of its loop triangles. Whether an
    object cuts is known from its materials alone; only then are its UVs read.
    """
    lines: list[str] = []
    covers = [opacities.of(material, lines) for material in materials_of(obj)]
    if not len(corners) or all(cover.alpha is None for cover in covers):
        return None, lines
    slots = slots_of(mesh, triangle_polygons, len(covers))
    alphas = list({id(cover.alpha): cover.alpha for cover in covers if cover.alpha is not None}.values())
    numbers = {id(alpha): number for number, alpha in enumerate(alphas)}
    table = np.array([numbers.get(id(cover.alpha), OPAQUE) for cover in covers], dtype=np.int32)
    uv = np.zeros((*corners.shape, 2), dtype=np.float32)
    for slot, cover in enumerate(covers):
        if cover.lookup is not None:
            here = slots == slot
            uv[here] = places_of(mesh, cover.lookup, corners[here])
    return simplified(Cutout(alphas, table[slots], uv)), lines
