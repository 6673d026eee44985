"""A scene's World as light from far away.

An image that is laid around as it is, or turned, is read from its own file. Any other World is evaluated by Cycles,
whatever its nodes (world_bake.py); where it is bright, as in the disc of a sun, it is looked at again, more closely.

The World is seen as surfaces see it: as by diffuse rays where its nodes tell rays apart, and without its volume.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ...core.base.errors import InputError
from ...core.spherical.environment import Environment, from_equirectangular, from_octahedral
from ...core.spherical.octahedral_map import middles, spread_of
from .world_bake import light_of_squares, world_scene
from .world_image import check_finite, pixels_of, plain_image
from .world_nodes import check_images

_LEAST, _MOST = 512, 2048  # points along its side, four a cell where that is between them
_BRIGHT = 16.0  # times the mean: there it is looked at more closely,
_CLOSER = 16  # at so many points along the side of one,
_PLACES = 4096  # at so many places at most


def read_world(scene: bpy.types.Scene, size: int = 256) -> Environment:
    """The light of a scene's World on a map of size × size cells; nothing of Blender's is changed.

    Raises InputError, a line naming the World or its image: there is none, it gives no light, an image's file is
    missing or broken, a pixel is not finite, or Cycles is needed and not enabled.
    """
    world = scene.world
    if world is None:
        raise InputError(f"{scene.name}: the scene has no World to light it; add one in Properties > World")
    environment = _from_image(world, size) or _from_cycles(scene, world, size)
    if not environment.radiance.any():
        raise InputError(
            f"{world.name}: it gives no light; give its Background a colour other than black and a strength above 0"
        )
    return environment


def _from_image(world: bpy.types.World, size: int) -> Environment | None:
    plain = plain_image(world)
    pixels = None if plain is None else pixels_of(plain)
    return None if plain is None or pixels is None else from_equirectangular(pixels, size, plain.rotation)


def _from_cycles(scene: bpy.types.Scene, world: bpy.types.World, size: int) -> Environment:
    check_images(world)
    side = min(max(4 * size, _LEAST), _MOST)
    with world_scene(scene, world) as passing:
        quarters = light_of_squares(passing, np.array([(-1.0, -1.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 0.0)]), side // 2)
        radiance = quarters.reshape(2, 2, side // 2, side // 2, 3).swapaxes(1, 2).reshape(side, side, 3)
        _look_closer(passing, radiance)
    check_finite(world.name, radiance)
    return from_octahedral(np.maximum(radiance, 0.0), size)


def _look_closer(scene: bpy.types.Scene, radiance: Floats) -> None:
    """Put better means where a map, (side, side, 3), is bright, and beside that."""
    side = len(radiance)
    luminance = radiance.sum(axis=2)
    framed = np.pad(luminance, 1, mode="edge")
    around = np.max([framed[i : i + side, j : j + side] for i in range(3) for j in range(3)], axis=0).ravel()
    places = np.lexsort((-luminance.ravel(), -around))[:_PLACES]  # the bright ones before those beside them
    places = places[around[places] > _BRIGHT * luminance.mean()]
    if not len(places):
        return
    corners = np.stack([places % side, places // side], axis=1) * (2.0 / side) - 1.0
    seen = light_of_squares(scene, corners, _CLOSER, 2.0 / side)
    points = corners[:, np.newaxis, np.newaxis] + (middles(_CLOSER) + 1.0) / side
    weights = spread_of(points)[..., np.newaxis]
    radiance.reshape(-1, 3)[places] = (seen * weights).sum(axis=(1, 2)) / weights.sum(axis=(1, 2))
