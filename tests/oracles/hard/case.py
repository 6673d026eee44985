"""A hard case, and the judgement of a bake of it.

What is right is either a value for each texel, or the bake of a clean twin: the same surface without what makes the
case hard. Bakes of 16 seeds are judged: their rays are independent, those of one seed are not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ....core.base.arrays import Doubles, Flags, Ints
from ....core.finish.baked import Baked
from ....core.rays.map_spec import AO, reflection
from ....core.rays.texel_surface import TexelSurface
from ....core.scene.checks import zero_area
from ....core.scene.scene import Instance, Scene
from ....core.scene.world_mesh import centre_of, world_surface
from ....core.settings import Settings
from ....core.texels.rasterize import Texels, rasterize
from ..settings import flat_settings
from .tiles import Tiles, bake_tiles, in_one_image

SEEDS = 16
FEW_SEEDS = 4  # enough where bits are compared, and for RO
T_BOUND = 6.5  # Student's t with 15 degrees of freedom: exceeded by chance with p = 1e-5
SIGMAS = 6.0  # of one texel, the binomial sigma being an upper bound of what a point set leaves
TWIN_SEED = 1000  # the first seed of the clean twin where it shall be independent


@dataclass(frozen=True, eq=False)
class View:
    """The texels of a scene's first target, without tracing: what an exact answer is computed from."""

    target: Instance
    width: int
    height: int

    @cached_property
    def texels(self) -> Texels:
        assert self.target.mesh.uv is not None
        skip = zero_area(self.target.mesh)
        return rasterize(self.target.name, self.target.mesh.uv, self.width, self.height, skip=skip)

    @property
    def owner(self) -> Ints:
        return self.texels.owner

    @property
    def covered(self) -> Flags:
        return self.texels.covered

    @cached_property
    def points(self) -> tuple[Doubles, Doubles]:
        """World-space positions and unit shading normals mid-footprint, (H, W, 3) float64 each."""
        origin = centre_of(self.target)
        surface = TexelSurface(world_surface(self.target, origin), self.owner)
        positions, normals = surface.positions, surface.normals
        return positions.astype(np.float64) + origin, normals.astype(np.float64)

    @property
    def local(self) -> Doubles:
        """(H, W, 3) float64 positions in the target's object space."""
        linear, shift = self.target.matrix[:3, :3], self.target.matrix[:3, 3]
        back: Doubles = np.linalg.inv(linear).T
        return (self.points[0] - shift) @ back

    @cached_property
    def geometric(self) -> Doubles:
        """(H, W, 3) float64 unit normals of the owners' planes in world space, by the winding of the mesh."""
        mesh, linear = self.target.mesh, self.target.matrix[:3, :3]
        a, b, c = (mesh.vertices[mesh.triangles[:, corner]].astype(np.float64) @ linear.T for corner in range(3))
        across = np.cross(b - a, c - a) * np.sign(np.linalg.det(linear))
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
        normals: Doubles = across[np.maximum(self.owner, 0)]
        return normals


@dataclass(frozen=True, eq=False)
class Case:
    """One hard case. right, cycles: a sentence each, for the page: what is right, and where Cycles is known to differ.

    expected: the exact value of each texel, (H, W), NaN where it is not known. twin: instead of it, the same surface
    without the trouble; from_twin carries its image to ours. bits: the twin must agree to the last bit, seed by seed.
    tiles: of a UDIM layout, put together in an image of the size. slack: what tessellation, or one value for a whole
    texel, may add; mean_slack the same for the mean.
    extra: more that must hold of the mean image, as a list of complaints. displaced: in Blender's file its meshes lie
    flat in z = 0, and their materials displace them to their heights.
    """

    name: str
    right: str
    cycles: str
    build: Callable[[], Scene]
    expected: Callable[[View], Doubles] | None = None
    twin: Callable[[], Scene] | None = None
    from_twin: Callable[[Doubles], Doubles] = np.asarray
    bits: bool = False
    size: tuple[int, int] = (64, 64)
    tiles: Tiles = (1, 1)
    rays: int = 16
    distance: float | None = None
    twin_distance: float | None = None
    slack: float = 0.0
    mean_slack: float = 0.0
    warns: str = ""
    extra: Callable[[Judged], list[str]] | None = None
    displaced: bool = False


@dataclass(frozen=True, eq=False)
class Judged:
    """A case baked and judged. ours: (H, W), the mean over seeds. right: (H, W), NaN where not known; right_means: a
    twin's mean by seed. right_rays: the rays a texel behind it, inf where it is exact. complaints: what is wrong, in
    lines."""

    case: Case
    view: View
    baked: Sequence[Baked]
    right: Doubles
    right_means: Doubles
    right_rays: float
    complaints: list[str] = field(default_factory=list)

    @cached_property
    def ours(self) -> Doubles:
        return mean_image(self.baked)

    @property
    def rays(self) -> int:
        return len(self.baked) * self.case.rays

    @property
    def known(self) -> Flags:
        """(H, W): texels whose right value is known."""
        mask: Flags = self.view.covered & np.isfinite(self.right)
        return mask


def settings_of(case: Case, seed: int = 0, distance: float | None = None) -> Settings:
    """AO, and by the first seeds RO, too, without margins; the image is that of a tile."""
    maps = (AO, reflection(10)) if seed < FEW_SEEDS else (AO,)
    width, height = (of_all // count for of_all, count in zip(case.size, case.tiles, strict=True))
    return flat_settings(
        maps, width=width, height=height, rays=case.rays, distance=distance or case.distance, margin=0, seed=seed
    )


def bake_seeds(scene: Scene, case: Case, first: int = 0, distance: float | None = None) -> list[Baked]:
    """The first target by 16 seeds."""
    one = Scene(scene.targets[:1], scene.occluders, scene.camera)
    seeds = FEW_SEEDS if case.bits else SEEDS
    return [bake_tiles(one, settings_of(case, first + seed, distance), case.tiles) for seed in range(seeds)]


def mean_image(baked: Sequence[Baked], name: str = "ao") -> Doubles:
    """(H, W) float64, the mean of those bakes that have the map."""
    made = [each.maps[name].values for each in baked if name in each.maps]
    image: Doubles = np.mean(made, axis=0, dtype=np.float64)
    return image


def judge(case: Case) -> Judged:
    """Bake a case by 16 seeds and say all that is wrong with it."""
    scene = case.build()
    view = View(in_one_image(scene, case.tiles).targets[0], *case.size)
    baked = bake_seeds(scene, case)
    twins: list[Baked] = []
    if case.twin is not None:
        twins = bake_seeds(case.twin(), case, 0 if case.bits else TWIN_SEED, case.twin_distance)
        right = case.from_twin(mean_image(twins))
    else:
        assert case.expected is not None
        right = np.asarray(case.expected(view), dtype=np.float64) * np.ones(view.covered.shape)
    rays = np.inf if not twins or case.bits else float(SEEDS * case.rays)
    means = np.array([_mean(case.from_twin(twin.maps["ao"].values.astype(np.float64)), view) for twin in twins])
    judged = Judged(case, view, baked, right, means, rays)
    judged.complaints.extend(_complaints(judged, twins))
    return judged


def _mean(image: Doubles, view: View) -> float:
    return float(image[view.covered].mean(dtype=np.float64))


def _complaints(judged: Judged, twins: Sequence[Baked]) -> list[str]:
    case = judged.case
    found = [*_sound(judged), *_texels(judged), *_means(judged)]
    if case.bits:
        found += _bits(judged, twins)
    if speckled := int(
        np.count_nonzero(speckles(judged.ours, judged.view.covered, judged.rays) & ~_right_speckles(judged))
    ):
        found.append(f"{speckled} dark speckles")
    if case.warns and not any(case.warns in line for line in judged.baked[0].warnings):
        found.append(f"no warning with {case.warns!r} in it: {judged.baked[0].warnings}")
    return found + (case.extra(judged) if case.extra else [])


def _sound(judged: Judged) -> list[str]:
    """Every owned texel has a value, and every value is a share."""
    found = []
    for baked in judged.baked:
        for name, made in baked.maps.items():
            if not np.array_equal(made.covered, judged.view.covered):
                found.append(f"{name}: the covered texels are not those of the UVs")
            if not (np.isfinite(made.values).all() and made.values.min() >= 0.0 and made.values.max() <= 1.0):
                found.append(f"{name}: values that are not in [0, 1]")
    return sorted(set(found))


def _texels(judged: Judged) -> list[str]:
    """Each texel within its noise of what is right; those that are closed, or open, exactly so, in RO too."""
    known, right, slack = judged.known, judged.right[judged.known], judged.case.slack
    ours = judged.ours[known]
    doubt = right if np.isinf(judged.right_rays) else (0.5 * (ours + right) * judged.rays + 1.0) / (judged.rays + 2.0)
    variance = np.clip(doubt * (1.0 - doubt), 0.0, 0.25) * (1.0 / judged.rays + 1.0 / judged.right_rays)
    beyond = np.abs(ours - right) > SIGMAS * np.sqrt(variance) + slack + 1e-6
    found = []
    if beyond.any():
        worst = int(np.argmax(np.where(beyond, np.abs(ours - right), 0.0)))
        found.append(
            f"{np.count_nonzero(beyond)} of {len(ours)} texels off, one {ours[worst]:.4f} for {right[worst]:.4f}"
        )
    if np.isfinite(judged.right_rays):
        return found
    reflected = mean_image(judged.baked, "ro_10")[known]
    for value, word in ((0.0, "leak"), (1.0, "dark")):
        exact = right == value
        wrong = exact & ((ours != value) | (reflected != value))
        if not judged.case.bits and slack == 0.0 and wrong.any():
            found.append(f"{np.count_nonzero(wrong)} of {np.count_nonzero(exact)} texels {word}")
    return found


def _means(judged: Judged) -> list[str]:
    """Student's t-test of the mean, over seeds."""
    if judged.case.bits or not judged.known.any():
        return []
    means = np.array([baked.maps["ao"].values[judged.known].mean(dtype=np.float64) for baked in judged.baked])
    exact = float(judged.right[judged.known].mean())
    spread = means.std(ddof=1) / np.sqrt(len(means))
    if len(judged.right_means):
        spread = np.hypot(spread, judged.right_means.std(ddof=1) / np.sqrt(len(judged.right_means)))
    if abs(means.mean() - exact) > T_BOUND * spread + judged.case.mean_slack + 1e-6:
        return [f"mean {means.mean():.5f} ± {spread:.5f} for {exact:.5f}"]
    return []


def _bits(judged: Judged, twins: Sequence[Baked]) -> list[str]:
    for ours, twin in zip(judged.baked, twins, strict=True):
        for name in ours.maps:
            theirs = judged.case.from_twin(twin.maps[name].values.astype(np.float64))
            if not np.array_equal(ours.maps[name].values, theirs):
                different = np.count_nonzero(ours.maps[name].values != theirs)
                return [f"{name}: not the bits of the clean twin, {different} texels"]
    return []


def speckles(values: Doubles, covered: Flags, rays: float) -> Flags:
    """(H, W): texels darker than all of their covered neighbours by more than six of their sigmas and a tenth.

    A texel needs three such neighbours, or a corner of a chart would count.
    """
    height, width = values.shape
    padded = np.pad(np.where(covered, values, np.inf), 1, constant_values=np.inf)
    shifts = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    around = np.stack([padded[i : i + height, j : j + width] for i, j in shifts])
    lowest, several = around.min(axis=0), np.isfinite(around).sum(axis=0) >= 3
    share = np.clip(np.where(np.isfinite(lowest), lowest, 0.0), 0.0, 1.0)
    dark = lowest - values > SIGMAS * np.sqrt(share * (1.0 - share) / rays) + 0.1
    mask: Flags = covered & several & dark
    return mask


def _right_speckles(judged: Judged) -> Flags:
    """Dark texels that are right: those of the exact answer or the twin, where it is known."""
    return speckles(np.where(judged.known, judged.right, 0.5), judged.view.covered, judged.right_rays) | ~judged.known
