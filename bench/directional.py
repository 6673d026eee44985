"""RO of any view from what a bake can keep of a texel: codes beside what engines make of AO and bent normals.

python -m occlusion_bake.bench.directional [SCENE...] [--points N] [--models DIR]

Truth is the sum over 16,384 rays of a point, one in each of 128 x 128 cells of equal solid angle, weighted by the lobe;
the cells that codes are made of hold 64 of the same rays each, so that there is next to no noise in the errors. Views
have n·v from 0.15 to 1. Prints RMSE of each scene by exponent, and of all of them by exponent, by view and by scene.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.base.arrays import Doubles, Floats
from ..core.spherical.directional_format import DirectionalFormat, encode, from_images, rebuild, to_images
from ..core.spherical.hemisphere_cells import HEMISPHERE, check_cells, directions, integrals
from ..core.spherical.lobe import open_horizon
from .pages import MODELS

EXPONENTS = (2.0, 10.0, 32.0, 100.0)
CODES = tuple(
    DirectionalFormat(kind, size)
    for kind, sizes in (("sh", (2, 3, 4, 6)), ("mask", (8, 16)), ("cells", (8, 16)))
    for size in sizes
)
IN_BYTES = DirectionalFormat("sh", 3)  # also as RGBA images of 8 bits
POINTS, RAYS_A_SIDE, VIEWS = 300, 128, 48
EDGES = (0.15, 0.35, 0.55, 0.75, 1.0)  # of the bands of n·v
CLOSER = (10.0, 32.0)  # exponents of the tables by view and by scene
BY_VIEW = ("AO as it is", "AO by Lagarde's formula", "AO and bent normal, cones (Jimenez et al.)", "sh_3", "mask_16")
BY_SCENE = ("sh_3", "mask_16")
_SIZE = 256  # texels a side of the image whose texels are drawn
_LIFT = 2.0**-18  # of the largest coordinate: how far above the surface rays start

RO = Callable[[Doubles, float], Doubles]  # (V, 3) views in the texels' frames and an exponent → (N, V) RO
Errors = dict[str, Doubles]  # mean squared errors by what is kept, each (E, V) by exponent and view


@dataclass(frozen=True, eq=False)
class Seen:
    """N surface points. frames: (N, 3, 3) float64, rows tangent, bitangent and normal. visible: (N, R²) bool, V along
    `ray_ways` in each frame."""

    frames: Doubles
    visible: NDArray[np.bool_]

    @property
    def cells(self) -> Floats:
        """(N, 16, 16) float32: the means of the rays in each cell."""
        within = RAYS_A_SIDE // 16
        means: Floats = self.visible.reshape(-1, 16, within, 16, within).mean(axis=(2, 4), dtype=np.float32)
        return means

    def truth(self, views: Doubles, exponent: float) -> Doubles:
        """RO of each point and view: (N, V) float64."""
        lobes = np.maximum(views @ ray_ways().T, 0.0) ** exponent
        lobes *= (open_horizon(exponent, views[:, 2]) / lobes.sum(axis=1))[:, None]
        ro: Doubles = np.stack([lobes @ row for row in self.visible])
        return ro


@cache
def ray_ways() -> Doubles:
    """(R², 3): the directions in which every point is looked from, one by chance in each cell of the finest grid."""
    rng = np.random.default_rng(0)
    row, column = np.indices((RAYS_A_SIDE, RAYS_A_SIDE))
    places = [(each + rng.random(each.shape)) / RAYS_A_SIDE for each in (column, row)]
    return directions(*places).reshape(-1, 3)


def visibility(scene: str, models: Path = MODELS, points: int = POINTS) -> Seen:
    """Random texels of a scene's first target, by the tracer."""
    import bpy

    from ..addon.read.scene_reader import SceneRequest, read_scene
    from ..core.rays.embree import open_device
    from ..core.rays.occluders import Occluders
    from ..core.rays.texel_surface import TexelSurface
    from ..core.scene.world_mesh import world_surface
    from .versus.subject import prepare

    subject = prepare(scene, _SIZE, models)
    read, _ = read_scene(bpy.context, bpy.context.view_layer, SceneRequest([subject.name]))
    target = read.targets[0]
    frame = Occluders(open_device(), read.occluders).frame_for(target)
    mesh = world_surface(target, frame.origin)
    surface = TexelSurface(mesh, subject.owner)
    chosen = np.random.default_rng(0).choice(np.flatnonzero(subject.covered), points, replace=False)
    places, normals = (each.reshape(-1, 3)[chosen].astype(np.float64) for each in (surface.positions, surface.normals))
    corners = mesh.vertices[mesh.triangles[subject.owner.reshape(-1)[chosen]]].astype(np.float64)
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    starts = places + _LIFT * np.abs(corners).max(axis=(1, 2))[:, None] * faces
    frames = frames_about(normals)
    seen = [
        frame.scene.visible(
            np.repeat(start[None], RAYS_A_SIDE**2, axis=0).astype(np.float32),
            np.ascontiguousarray(ray_ways() @ axes, dtype=np.float32),
        )
        for start, axes in zip(starts, frames, strict=True)
    ]
    return Seen(frames, np.array(seen))


def frames_about(normals: Doubles) -> Doubles:
    """(N, 3) unit normals → (N, 3, 3): rows tangent, bitangent and normal; any tangent will do."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    tangent = np.cross(helper, normals)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.stack([tangent, np.cross(normals, tangent), normals], axis=1)


def views(count: int = VIEWS) -> Doubles:
    """(count, 3) reflected directions, n·R = n·v evenly from 0.15 to 1, by the golden angle about the normal."""
    cosines = np.linspace(0.15, 1.0, count)
    turns = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    sines = np.sqrt(1.0 - cosines**2)
    return np.stack([sines * np.cos(turns), sines * np.sin(turns), cosines], axis=1)


def errors(cells: Floats, truth: RO) -> Errors:
    """Means over N texels. cells: (N, 16, 16) mean visibilities, which may be noisy; truth: theirs."""
    check_cells(cells)
    looked = views()
    true = [truth(looked, exponent) for exponent in EXPONENTS]
    return {
        name: np.stack(
            [np.mean((estimate(looked, each) - ro) ** 2, axis=0) for each, ro in zip(EXPONENTS, true, strict=True)]
        )
        for name, estimate in _estimates(cells)
    }


def _estimates(cells: Floats) -> Iterator[tuple[str, RO]]:
    for name, formula in FORMULAS.items():
        yield name, _from_means(cells, formula)
    for code in CODES:
        values = encode(cells, code)
        yield code.name, _from_code(values, code)
        if code == IN_BYTES:
            stored = from_images(to_images(values[None], code, 8), code)[0]
            yield f"{code.name}, RGBA images of 8 bits", _from_code(stored, code)


def _from_code(values: Floats, code: DirectionalFormat) -> RO:
    def estimate(looked: Doubles, exponent: float) -> Doubles:
        repeated = (np.repeat(view[None], len(values), axis=0) for view in looked)
        return np.stack([rebuild(values, code, each, exponent) for each in repeated], axis=1).astype(np.float64)

    return estimate


Formula = Callable[[Doubles, Doubles, Doubles, float], Doubles]  # AO (N, 1), bent normals (N, 3), views, exponent


def _from_means(cells: Floats, formula: Formula) -> RO:
    """A formula of AO and the bent normal: V cos θ over π, and the mean of V times the direction, at unit length."""
    vectors = cells.reshape(len(cells), -1) @ integrals(lambda ways: ways, cells.shape[1])
    ao = vectors[:, 2:] / np.pi
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    bent = np.where(length > 0.0, vectors / np.maximum(length, 1e-12), (0.0, 0.0, 1.0))
    return lambda looked, exponent: formula(ao, bent, looked, exponent)


def ao_as_it_is(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """AO in the place of RO."""
    return np.repeat(ao, len(looked), axis=1)


def ao_over_horizon(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """AO times what an open surface gets."""
    return ao * open_horizon(exponent, looked[:, 2])


def lagarde(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """Lagarde & de Rousiers, Moving Frostbite to Physically Based Rendering (2014): of AO, n·v and roughness."""
    power = np.exp2(-16.0 * roughness(exponent) - 1.0)
    return np.clip((looked[:, 2] + ao) ** power - 1.0 + ao, 0.0, 1.0)


def cones(ao: Doubles, bent: Doubles, looked: Doubles, exponent: float) -> Doubles:
    """Jimenez et al., Practical Realtime Strategies for Accurate Indirect Occlusion (2016): the share of the lobe's
    cone within the cone of visibility, cos² of whose half angle is 1 − AO, by the intersection of Oat & Sander
    (Ambient Aperture Lighting, 2007)."""
    visible = np.arccos(np.sqrt(np.clip(1.0 - ao, 0.0, 1.0)))
    lobe = np.arccos(10.0 ** -(roughness(exponent) ** 2))
    apart = np.arccos(np.clip(bent @ looked.T, -1.0, 1.0))
    differ = np.abs(visible - lobe)
    beyond = np.clip((apart - differ) / np.maximum(visible + lobe - differ, 1e-9), 0.0, 1.0)
    within = 1.0 - beyond**2 * (3.0 - 2.0 * beyond)  # smoothstep
    cap = HEMISPHERE * (1.0 - np.cos(np.minimum(visible, lobe)))
    return cap * within / (HEMISPHERE * (1.0 - np.cos(lobe)))


def roughness(exponent: float) -> float:
    """The width α of a Beckmann or GGX lobe that is as wide as Phong's."""
    return float(np.sqrt(2.0 / (exponent + 2.0)))


FORMULAS: Mapping[str, Formula] = {
    "AO as it is": ao_as_it_is,
    "AO times the open horizon": ao_over_horizon,
    "AO by Lagarde's formula": lagarde,
    "AO and bent normal, cones (Jimenez et al.)": cones,
}


def pooled(found: Sequence[Errors]) -> Errors:
    """Means over several sets of as many texels."""
    return {name: np.mean([one[name] for one in found], axis=0) for name in found[0]}


def rmse(squares: Doubles, exponent: float, band: int | None = None) -> float:
    """Over all views, or those of one band of n·v, the lowest first."""
    of_view = squares[EXPONENTS.index(exponent)]
    if band is not None:
        of_view = of_view[np.digitize(views(len(of_view))[:, 2], EDGES[1:-1]) == band]
    return float(np.sqrt(of_view.mean()))


def by_exponent(found: Errors) -> list[str]:
    """Lines of a page: RMSE over all views."""
    rows = {name: [f"{rmse(squares, each):.4f}" for each in EXPONENTS] for name, squares in found.items()}
    return _table(["kept of a texel", *(f"exponent {each:g}" for each in EXPONENTS)], rows)


def by_view(found: Errors) -> list[str]:
    """Lines of a page: RMSE at CLOSER's exponents, in each band of n·v."""
    bands = range(len(EDGES) - 1)
    rows = {name: [_closer(found[name], band) for band in bands] for name in BY_VIEW}
    return _table(["kept of a texel", *(f"n·v {EDGES[each]:g} to {EDGES[each + 1]:g}" for each in bands)], rows)


def by_scene(found: Mapping[str, Errors]) -> list[str]:
    """Lines of a page: RMSE at CLOSER's exponents, of each scene."""
    rows = {f"`{scene}`": [_closer(one[name]) for name in BY_SCENE] for scene, one in found.items()}
    return _table(["scene", *BY_SCENE], rows)


def _closer(squares: Doubles, band: int | None = None) -> str:
    return ", ".join(f"{rmse(squares, each, band):.4f}" for each in CLOSER)


def _table(heads: Sequence[str], rows: Mapping[str, Sequence[str]]) -> list[str]:
    first, *others = (f"| {' | '.join(each)} |" for each in (heads, *((name, *row) for name, row in rows.items())))
    return [first, "|" + "---|" * len(heads), *others]


def main(arguments: Sequence[str]) -> int:
    """The command."""
    import bpy  # noqa: F401  # there is no bmesh before it

    from .versus.scenes import names

    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.directional", description="RO of any view.")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="which (all of bench/versus that are there)")
    parser.add_argument("--points", type=int, default=POINTS, help=f"texels of each scene ({POINTS})")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of .obj models")
    chosen = parser.parse_args(arguments)
    found, known = {}, names(chosen.models)
    for unknown in (name for name in chosen.scenes if name not in known):
        parser.error(f"{unknown}: no such scene; there are {', '.join(known)}")
    for name in chosen.scenes or known:
        seen = visibility(name, chosen.models, chosen.points)
        found[name] = errors(seen.cells, seen.truth)
        _say(name, by_exponent(found[name]))
    everything = pooled(list(found.values()))
    at = f"at exponents {' and '.join(f'{each:g}' for each in CLOSER)}"
    _say("All", by_exponent(everything))
    _say(f"By view, {at}", by_view(everything))
    _say(f"By scene, {at}", by_scene(found))
    return 0


def _say(title: str, lines: Sequence[str]) -> None:
    print("\n".join([f"## {title}", "", *lines, ""]), flush=True)


if __name__ == "__main__":
    from ..addon.cli.hard_exit import run_and_exit

    run_and_exit(main)
