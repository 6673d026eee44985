"""RO as a share of what an open surface would get: what a leaning lobe loses below the horizon, divided out.

RO of an open plane is not 1 where the reflected direction leans towards the horizon, but H_e(α) of `lobe.open_horizon`.
That is right for light that is not there below the horizon; divided by it, an open point is 1 from every view.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Doubles, Floats
from ..base.vectors import dot, length_of
from ..rays.texel_surface import TexelSurface
from ..scene.scene import Camera


def cosines_to_reflected(surface: TexelSurface, camera: Camera) -> Doubles:
    """cos α between the shading normal and R = d − 2(d·n)n, d the view of the texel: (H, W) float64.

    camera: in the frame of the surface. Taken at the middle of each texel's footprint; below 0 where that faces away
    from the camera, and 0 where there is no owner.
    """
    passing = surface.part(surface.owner)  # its points are let go again: while rays are traced, memory is at its peak
    positions, normals = (each.astype(np.float64) for each in (passing.positions, passing.normals))
    view = camera.views(positions)
    length = length_of(view)
    along = -dot(view, normals)  # R·n = −d·n
    cosines: Doubles = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    return cosines


def divide(sums: Floats, openness: Doubles) -> None:
    """Divide a map's sums, in place, by what an open surface would get; both of one shape, openness above 0.

    The estimate stays unbiased, so that noise may carry a value above 1. Texels without a value (-1) stay so.
    """
    np.divide(sums, openness, out=sums, where=sums > 0.0, casting="same_kind")
