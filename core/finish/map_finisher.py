"""From solved rows to finished images: margins, bent normals, light."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..rays.accumulators import Counts, bent_vectors
from ..rays.map_spec import AO, Axis, Estimator
from ..scene.scene import Camera, Doubles, Floats, Ints, Placed
from ..solve.probes import Error
from ..solve.solver import Solved
from ..spherical.environment import Environment, open_light
from ..texels.rasterize import in_bands, surface_points
from ..texels.tangent_space import Texture
from .bent_normals import Bent, encoded
from .margin import fill_margins

BENT_NAME = "bent"
RATIO, LIGHT = "ratio", "light"  # pictures of an estimator of light: the share that gets through, and the light itself
_BAND = 1 << 18  # texels that are worked on at a time


@dataclass(frozen=True, eq=False)
class BakedMap:
    """One finished image. values: (H, W) float32, or (H, W, C), with margins; covered: (H, W) bool; coverage: (H, W)
    float32, 0 in margins; error: measured RMSE over the covered texels, and p99 the error that 99 of 100 stay within
    (probes.py); mean: theirs, of all channels; rays: all that made it, but for those that measured its error; mixes:
    whether values of texels may be averaged, as bytes of masks may not, which therefore have no margin. Values are 0 to
    1, but for noise above 1 where the horizon was divided out and nothing filtered, and but for light.

    Of bent normals the error is the length of the difference, of small angles these in radians, each texel counted by
    its AO. Of light it is that of the share that gets through, as of its ratio."""

    values: Floats
    covered: NDArray[np.bool_]
    coverage: Floats
    error: float
    p99: float
    mean: float
    rays: int
    mixes: bool = True


@dataclass(frozen=True, eq=False)
class Finisher:
    """What all images of one object have in common. surface, owner: as they were traced; texture: as the images lie on
    the target."""

    surface: Placed
    owner: Ints
    texture: Texture
    coverage: Floats
    margin: int
    camera: Camera | None
    environment: Environment | None
    bent: Bent | None
    threads: int

    def maps(self, estimator: Estimator, solved: Solved, wanted: Collection[str]) -> Iterator[tuple[str, BakedMap]]:
        """The images of one estimator by name; wanted: names of the maps that were asked for by name."""
        if estimator.counts is Counts.LIGHT:
            assert solved.more is not None
            shares = np.ascontiguousarray(np.moveaxis(solved.more, 0, -1))
            ratio, level = picture_of(estimator, RATIO), picture_of(estimator, LIGHT)
            if ratio in wanted:
                yield ratio, self._solved(shares, solved, solved.error)
            if level in wanted:
                yield level, self._solved(shares * self._open(estimator, solved.covered), solved, solved.error)
            return
        if estimator.name in wanted:
            yield estimator.name, self._solved(solved.values, solved, solved.error)
        if estimator.counts is Counts.BENT:
            assert solved.more is not None and solved.more_error is not None
            yield BENT_NAME, self._solved(self._bent(solved), solved, solved.more_error)

    def _bent(self, solved: Solved) -> Floats:
        assert self.bent is not None and solved.more is not None
        colours = encoded(bent_vectors(solved.more), self.bent, self.texture, solved.covered)
        return np.dstack([colours, solved.values]) if self.bent.with_ao else colours

    def _open(self, estimator: Estimator, covered: NDArray[np.bool_]) -> Floats:
        """(H, W, 3) float32: the light that an open surface would get."""
        assert self.environment is not None
        positions, normals = surface_points(self.surface, self.owner, threads=self.threads)
        light = np.zeros((*covered.shape, 3), dtype=np.float32)
        flat = light.reshape(-1, 3)
        for these in in_bands(np.flatnonzero(covered), _BAND):
            normal = normals.reshape(-1, 3)[these].astype(np.float64)
            axes = normal
            if estimator.axis is Axis.REFLECTED:
                axes = self._reflected(positions.reshape(-1, 3)[these].astype(np.float64), normal)
            flat[these] = open_light(self.environment, axes, normal, estimator.exponent, threads=self.threads)
        return light

    def _reflected(self, position: Doubles, normal: Doubles) -> Doubles:
        assert self.camera is not None
        view = self.camera.views(position)
        view = view / np.linalg.norm(view, axis=-1, keepdims=True)
        mirrored: Doubles = view - 2.0 * (view * normal).sum(axis=-1, keepdims=True) * normal
        return mirrored

    def _solved(self, values: Floats, solved: Solved, error: Error) -> BakedMap:
        return self.finished(values, solved.covered, error, solved.rays)

    def finished(
        self, values: Floats, covered: NDArray[np.bool_], error: Error, rays: int, *, mixes: bool = True
    ) -> BakedMap:
        """A map with its margin, written into `values`. covered: (H, W) bool, texels with a value."""
        coverage = np.where(covered, self.coverage, np.float32(0.0))
        where = covered if values.ndim == 2 else covered[..., np.newaxis]
        mean = float(values.mean(dtype=np.float64, where=where)) if covered.any() else 0.0
        return with_margin(BakedMap(values, covered, coverage, error.rmse, error.p99, mean, rays, mixes), self.margin)


def with_margin(made: BakedMap, margin: int) -> BakedMap:
    """The map with its charts' borders carried outward by so many texels, where its values may be averaged."""
    return replace(made, values=fill_margins(made.values, made.covered, margin)) if made.mixes else made


def picture_of(estimator: Estimator, kind: str) -> str:
    """What a picture of light is called."""
    return f"{estimator.name}_{RATIO}" if kind == RATIO else estimator.name


def traced_estimators(estimators: tuple[Estimator, ...], bent: Bent | None) -> tuple[Estimator, ...]:
    """What is traced for the maps that are wanted: bent normals come from the rays of AO."""
    if bent is None:
        return estimators
    with_bent = Estimator(AO.name, AO.exponent, counts=Counts.BENT)
    others = tuple(each for each in estimators if each != AO)
    return (with_bent, *others)
