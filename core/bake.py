"""The way through the house: scene → texels → rays → solve → finish, one object at a time.

Here stand its beginning and its end, for an object as a whole; `part_bake` tells the way between.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .base.arrays import Flags, Ints
from .base.errors import InputError
from .base.timing import Stopwatch
from .charts.udim import in_tile, outside_tile, part_in_tile
from .finish.atlas import Atlas
from .finish.baked import Baked
from .input_hash import InputHashes
from .maps.occlusion import ambient_among
from .part_bake import Layout, PartBaker, Shared
from .progress import Progress
from .rays.embree import open_device
from .rays.map_spec import Axis
from .rays.occluders import Occluders
from .scene.checks import check_target, zero_area
from .scene.parts import Part, parts_of
from .scene.scene import Camera, Instance, Scene
from .settings import Settings
from .solve.goal import Goal
from .texels import flipped_faces, interior
from .texels.high_to_low import missed_warning
from .texels.rasterize import Texels, rasterize
from .texels.tangent_space import TexelFrames, check_tangents

__all__ = ["Baked", "Baker", "Goal", "Settings", "bake"]

FARTHEST_CAMERA = 1e30  # float32 holds it, whatever the frame's origin
_ANY_SIZE = (16, 16)  # whether UVs cover any texel does not depend on it
_TEXELS = (0.0, 0.02)  # of the time that an object takes, for the progress bar; more in part_bake.py


def bake(scene: Scene, settings: Settings, progress: Progress | None = None) -> Iterator[Baked]:
    """Bake the scene's targets one after the other; each result can be written and forgotten before the next.

    Raises as `Baker` and its `bake`.
    """
    baker = Baker(scene, settings, progress)
    yield from map(baker.bake, scene.targets)


class Baker:
    """Bakes the targets of one scene with one set of settings; occluders are stored once for all of them.

    Raises InputError where a map needs a camera or a World and the scene has none, or where there is no Embree.
    """

    def __init__(self, scene: Scene, settings: Settings, progress: Progress | None = None) -> None:
        _check_scene(scene, settings)
        self.device = open_device(settings.threads)
        self.scene = scene
        self._settings = settings
        self._progress = progress or Progress()
        self._progress.expect(len(scene.targets))
        occluders = Occluders(self.device, scene.occluders, settings.rays, _reserved(scene))
        self._shared = Shared(scene, settings, self._progress, self.device, occluders)
        self._hashes = InputHashes(scene, settings, occluders)
        self._untold = list(occluders.warnings)

    def bake(self, target: Instance, tile: int | None = None, size: tuple[int, int] | None = None) -> Baked:
        """Bake one object, of a UDIM layout one tile. size: of its image, the settings' where it has none of its own.
        Raises InputError for one that cannot be baked, Cancelled, MemoryError.

        Same scene and settings, same bits, whatever the number of threads, and whatever else is baked.
        """
        try:
            baked = self._bake(target, tile, size or self._settings.image.size)
        finally:
            self._progress.preview = None
            self._progress.finish_object()
        baked.warnings[:0] = self._untold  # those on occluders stand once, with the first object
        self._untold = []
        return baked

    def check(self, target: Instance, tile: int | None = None) -> None:
        """Refuse at once what `bake` would refuse, as far as that can be told before anything is traced. Raises
        InputError."""
        self._checked(target)
        self._texels(target, in_tile(target, tile), tile, _ANY_SIZE, threads=1)

    def inputs_of(self, target: Instance, tile: int | None = None) -> str:
        """The hash of all that the texture of a target, or of one of its tiles, depends on (input_hash.py)."""
        return self._hashes.of(target, tile)

    def _checked(self, target: Instance) -> list[str]:
        """Warnings on it."""
        warnings = check_target(target)
        if self._settings.needs_tangents:
            check_tangents(target)
        return warnings

    def _bake(self, target: Instance, tile: int | None, size: tuple[int, int]) -> Baked:
        clock = Stopwatch()
        warnings = self._checked(target)
        with clock.stage("inputs"):
            inputs = self.inputs_of(target, tile)
        laid_out = in_tile(target, tile)
        with clock.stage("texels"):
            texels = self._texels(target, laid_out, tile, size, self._settings.threads)
        frames = TexelFrames(laid_out, texels.owner)
        layout = Layout(target, laid_out, part_in_tile(target, tile), texels, frames, clock)
        baked = self._of_parts(layout)
        if target.name in self.scene.highs:
            warnings += missed_warning(target.name, baked.texels, int(np.count_nonzero(texels.owner >= 0)))
        baked.surface.overlapped, baked.seconds = texels.overlapped, clock.seconds
        baked.tile, baked.inputs = tile, inputs
        baked.warnings[:0] = warnings + texels.warnings + _what_is_wrong(target, baked)
        return baked

    def _texels(
        self, target: Instance, laid_out: Instance, tile: int | None, size: tuple[int, int], threads: int
    ) -> Texels:
        """laid_out: the target as the tile has its UVs."""
        mesh, tiled = laid_out.mesh, tile is not None
        if mesh.uv is None:
            raise InputError(f"{target.name}: the mesh has no UV map; unwrap it, or bake with chart UVs (--uv charts)")
        control = self._progress.enter(f"{target.name}: texels", _TEXELS)
        skip = zero_area(mesh) | outside_tile(target.mesh, tile)
        return rasterize(target.name, mesh.uv, *size, skip=skip, tiled=tiled, threads=threads, control=control)

    def _of_parts(self, layout: Layout) -> Baked:
        """Nearly always of one. Of several none is kept: each image is as large as the whole."""
        margin, owner = self._settings.image.margin, layout.texels.owner
        with layout.clock.stage("texels"):
            parts = parts_of(layout.target, _with_texels(layout.target, owner))
        if len(parts) == 1:
            return PartBaker(self._shared, layout, margin).bake(parts[0], owner)
        baker, whole = PartBaker(self._shared, layout, margin=0), Atlas(layout.target.name)
        for number, part in enumerate(parts):
            self._progress.begin_part(number, len(parts))
            whole.add(baker.bake(part, np.where(_owned_by(part, owner), owner, np.int32(-1))))
        with layout.clock.stage("finish"):
            return whole.finish(margin)


def _with_texels(target: Instance, owner: Ints) -> Flags:
    """(T,) bool: the triangles that own any."""
    having = np.zeros(len(target.mesh.triangles) + 1, dtype=np.bool_)
    having[owner] = True  # -1, none, is the last
    return having[:-1]


def _owned_by(part: Part, owner: Ints) -> Flags:
    """(H, W) bool: the texels of a part's triangles."""
    assert part.triangles is not None
    owned: Flags = (owner >= 0) & part.triangles[owner]
    return owned


def _check_scene(scene: Scene, settings: Settings) -> None:
    """What the maps need of it."""
    if any(each.axis is Axis.REFLECTED for each in settings.specs):
        _check_camera(scene.camera)
    if settings.needs_light and scene.environment is None:
        raise InputError("the scene has no World to take light from; add one in World properties, or bake no light")


def _check_camera(camera: Camera | None) -> None:
    cure = "or bake RO with direction normal"
    if camera is None:
        raise InputError(f"the scene has no camera to take R from; add one, {cure}")
    numbers = np.abs([*camera.position, *camera.forward])
    if not (numbers < FARTHEST_CAMERA).all():
        raise InputError(f"the scene's camera: its transform is not finite, or too far away; clear it, {cure}")


def _reserved(scene: Scene) -> dict[str, set[str]]:
    """Objects that block light for some targets alone, and those targets."""
    reserved: dict[str, set[str]] = {name: set() for name in scene.private}
    for target in scene.targets:
        highs = scene.highs.get(target.name)
        for owner in [target] if highs is None else highs.meshes:
            if owner.belongs_to in reserved:
                reserved[owner.belongs_to].add(target.name)
    return reserved


def _what_is_wrong(target: Instance, baked: Baked) -> list[str]:
    """A line for each thing that the artist may want to mend."""
    report = baked.surface
    inside = interior.warning(target.name, report.interior)
    lines = inside + flipped_faces.warnings(target.name, report.flipped, report.buried)
    if (ambient := ambient_among(baked.maps)) is not None and not inside:
        overlapped = report.overlapped / max(report.texels, 1)
        lines += flipped_faces.dark_warnings(target.name, baked.maps[ambient].mean, overlapped, report.sights)
    return lines
