"""Which share of an object lies inside other meshes: nothing is changed, but the artist is told."""

from __future__ import annotations

from ctypes import byref

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Longs
from ..rays.texel_surface import TexelSurface
from ..rays.trace_scene import TraceScene

SAMPLED = 2048  # texels that are looked at: the standard error is 1.1 % of the texels at worst, 0.2 % at a share of 1 %
TOLD = 0.02  # a smaller share, roots of leaves in their stems say, is no matter for a warning


def interior_share(scene: TraceScene, surface: TexelSurface, own: int, *, control: api.Control | None = None) -> float:
    """Share of the owned texels, 0 to 1, from which rays to all sides get out of a mesh that they did not get into.

    own: the number of the surface's own geometry in the scene, -1 none; its faces do not count. Inside a closed mesh
    that is so of every ray, whatever else is in there and at whatever distance; of open sheets a texel must see the
    backs all around. Where faces of the two meshes coincide the share is a lower bound. At most SAMPLED texels are
    looked at, evenly spread, always the same. 0 where there is no texel. Raises Cancelled, InputError.
    """
    texels = spread(np.flatnonzero(surface.covered))
    if len(texels) == 0:
        return 0.0
    inside, described = np.zeros(len(texels), dtype=np.uint8), surface.described()
    status = api.library().ob_interior(
        scene.handle,
        byref(described),
        own,
        api.address(texels, np.int64, len(texels)),
        len(texels),
        surface.threads,
        api.address(inside, np.uint8, len(texels)),
        api.pointer_to(control),
    )
    api.check(status)
    return float(inside.mean())


def warning(name: str, share: float) -> list[str]:
    """The line for an object of which a part worth telling lies inside others, or none."""
    if share < TOLD:
        return []
    return [
        f"{name}: about {100.0 * share:.0f} % of the texels lie inside another mesh, or behind faces that turn "
        "away; move the objects apart, hide the outer one from render, or turn its faces round"
    ]


def spread(texels: Longs) -> Longs:
    """Of (N,) texels at most SAMPLED: one from each of as many equal runs, at a place that follows the golden ratio, so
    that no column of the image is preferred."""
    if len(texels) <= SAMPLED:
        return texels
    run = np.arange(SAMPLED, dtype=np.int64)
    within = (run * 0.6180339887498949) % 1.0
    return texels[((run + within) * (len(texels) / SAMPLED)).astype(np.int64)]
