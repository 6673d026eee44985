"""Normal maps of a target's materials, as they lie on its mesh. What they do stands in texels/shading_normals.py."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..base.arrays import Floats, Ints
from ..base.errors import InputError
from .image_texture import ImageTexture

PLAIN = -1  # in the place of a layer's number


@dataclass(frozen=True, eq=False)
class NormalMapLayer:
    """One material's normal map in tangent space.

    texture: (h, w, 3) values as colours, 0.5 for 0, the third along the normal. tangents: (T, 3, 4) float32, of the UV
    map that the map is made for, as those of `Mesh`. strength: what its first two are multiplied by.
    """

    texture: ImageTexture
    tangents: Floats
    strength: float = 1.0


@dataclass(frozen=True, eq=False)
class NormalMap:
    """What lies on the triangles of one mesh. layer: (T,) int32, which of `layers`, PLAIN for none. uv: (T, 3, 2)
    float32 per corner, v up, places in the textures. Raises InputError for arrays that do not fit one another."""

    layers: Sequence[NormalMapLayer]
    layer: Ints
    uv: Floats

    def __post_init__(self) -> None:
        if self.uv.shape != (len(self.layer), 3, 2):
            raise InputError(
                f"normal map: UVs of shape {self.uv.shape} do not fit {len(self.layer)} triangles; give (T, 3, 2)"
            )
        if len(self.layer) and not PLAIN <= self.layer.min() <= self.layer.max() < len(self.layers):
            raise InputError(f"normal map: a triangle names a layer that does not exist; there are {len(self.layers)}")
