"""What must hold whatever is baked. Each check takes one drawn case and raises AssertionError where it does not."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from ...core.bake import bake
from ...core.base.arrays import Doubles, Floats
from ...core.base.errors import InputError
from ...core.finish.baked import Baked, BakedMap
from ...core.finish.compare import compare, comparison_image
from ...core.finish.image_file import FORMATS, read_image, suffix, write_image
from ...core.finish.margin import fill_margin
from ...core.rays.boxes import FARTHEST
from ...core.scene.checks import LARGEST, SMALLEST
from ...core.scene.scene import Camera, Instance, Mesh, Scene
from ...core.scene.world_mesh import bounds_of
from ...core.settings import Settings
from ...core.texels.rasterize import owners_by_centre, rasterize
from .charts.properties import chart_cases, charts_are_sound
from .wild_bakes import (
    MATRICES,
    UVS,
    WildBake,
    WildMap,
    WildMesh,
    WildObject,
    rotation,
    tame_bakes,
    tame_objects,
    wild_bakes,
)

# What a refusal may begin with: the target's name, or a setting's.
SUBJECTS = (
    "target: ",
    "distance ",
    "the distance ",
    "the scene has no camera",
    "the scene's camera: ",
    "uniform_hemisphere ",
)
GRAZING = 0.02  # by so much rays along edges may change the mean, in scenes all edges


def assert_refusal(error: InputError, *subjects: str) -> None:
    """One line that begins with what it is about."""
    text = str(error)
    assert "\n" not in text and text.startswith(subjects or SUBJECTS), text


def is_sound(case: WildBake) -> None:
    """Refused in one line, or every value finite and in its range."""
    try:
        settings = case.settings()
        (baked,) = bake(case.scene(), settings)
    except InputError as error:
        assert_refusal(error)
        return
    for warning in baked.warnings:
        assert "\n" not in warning and warning.startswith(("target: ", "other ")), warning
    for wild, result in zip(case.maps, baked.maps.values(), strict=True):
        divided = case.divided and wild.from_camera
        most = most_of(wild) * (2.0 if divided else 1.0)  # half a lobe is left at the least
        assert_sound_map(result, settings, most)
        count = np.count_nonzero(result.covered)
        assert count <= baked.texels if wild.from_camera else count == baked.texels


def most_of(wild: WildMap) -> float:
    """The largest weight of a ray: 2(e+1) over the sphere, e+1 over the hemisphere, 1 by importance; and rounding."""
    lobe = 1.0 if wild.exponent is None else wild.exponent
    weight = {"importance": 1.0, "uniform_hemisphere": lobe + 1.0, "uniform_sphere": 2.0 * (lobe + 1.0)}[wild.sampler]
    return weight if wild.sampler == "importance" else weight * (1.0 + 1e-5)


def assert_sound_map(result: BakedMap, settings: Settings, most: float) -> None:
    """Importance-sampled values count rays, so that not even rounding leaves [0, 1]; naive ones are weighted."""
    values, covered, coverage = result.values, result.covered, result.coverage
    shape = (settings.image.height, settings.image.width)
    assert values.shape == covered.shape == coverage.shape == shape and values.dtype == np.float32
    assert np.isfinite(values).all() and values.min() >= 0.0
    assert values.max() <= most
    assert np.all(coverage[~covered] == 0.0) and coverage.min() >= 0.0 and coverage.max() <= 1.0
    assert np.all(coverage[covered] > 0.0)
    assert np.isfinite(result.error) and result.error >= 0.0
    if covered.any():
        inside = values[covered]
        assert np.all(values[~covered] >= inside.min()) and np.all(values[~covered] <= inside.max())
        assert abs(result.mean - inside.mean(dtype=np.float64)) <= 1e-6 * max(1.0, float(inside.max()))
    else:
        assert np.all(values == 1.0) and result.mean == 1.0


def baked_or_none(scene: Scene, settings: Settings) -> Baked | None:
    """A bake; None where it is refused."""
    try:
        (baked,) = bake(scene, settings)
    except InputError as error:
        assert_refusal(error)
        return None
    return baked


def pairs(case: WildBake, one: Scene, other: Scene, **changes: Any) -> list[tuple[BakedMap, BakedMap]]:
    """The maps of two scenes, the second with settings changed; none where the first is refused."""
    first = baked_or_none(one, case.settings())
    second = baked_or_none(other, replace(case, **changes).settings())
    assert (first is None) == (second is None)
    return [] if first is None or second is None else list(zip(first.maps.values(), second.maps.values(), strict=True))


def farther_never_brightens(case: WildBake, factor: float) -> None:
    """The same rays, longer, meet at least what they met: exact, texel by texel."""
    assert case.distance is not None
    for near, far in pairs(case, case.scene(), case.scene(), distance=case.distance * factor):
        assert np.all(far.values <= near.values)
    for near, far in pairs(case, case.scene(), case.scene(), distance=None):
        assert np.all(far.values <= near.values)


def an_occluder_never_brightens(case: WildBake, added: WildObject) -> None:
    """The frame is the target's, so the rays are the same: exact, texel by texel."""
    scene = case.scene()
    more = Scene(scene.targets, [*scene.occluders, added.build("added")], scene.camera)
    for without, with_it in pairs(case, scene, more):
        assert_array_equal(without.covered, with_it.covered)
        assert np.all(with_it.values <= without.values)


def moved(scene: Scene, matrix: Doubles) -> Scene:
    """Everything under one more matrix, the camera too."""

    def place(instance: Instance) -> Instance:
        return replace(instance, matrix=matrix @ instance.matrix)

    camera = scene.camera
    if camera is not None:
        position = matrix[:3, :3] @ camera.position + matrix[:3, 3]
        forward = matrix[:3, :3] @ camera.forward
        camera = Camera(tuple(position.tolist()), tuple(forward.tolist()), camera.orthographic)
    return Scene([place(target) for target in scene.targets], [place(each) for each in scene.occluders], camera)


def scaled(case: WildBake, factor: float) -> list[tuple[BakedMap, BakedMap]]:
    """The maps here and there; none where something is then too small or too large to trace."""
    there = moved(case.scene(), np.diag([factor, factor, factor, 1.0]))
    if not SMALLEST <= _size(there.targets[0]) <= LARGEST or max(map(_size, there.occluders), default=0.0) > FARTHEST:
        return []
    distance = None if case.distance is None else case.distance * factor
    return pairs(case, case.scene(), there, distance=distance)


def _size(instance: Instance) -> float:
    low, high = bounds_of(instance)
    return float((high - low).max())


def stray_vertices_change_no_bit(case: WildBake, power: float) -> None:
    """Loose vertices, far off, of the target and of what is around it."""

    def littered(instance: Instance) -> Instance:
        stray = np.array([[10.0**power, -(10.0**power), 1.0]], dtype=np.float32)
        return replace(instance, mesh=meshes.setdefault(id(instance.mesh), _with_vertices(instance.mesh, stray)))

    scene, meshes = case.scene(), dict[int, Mesh]()
    strewn = Scene(
        [littered(each) for each in scene.targets], [littered(each) for each in scene.occluders], scene.camera
    )
    for plain, other in pairs(case, scene, strewn):
        assert_array_equal(plain.values, other.values)


def _with_vertices(mesh: Mesh, more: Floats) -> Mesh:
    return replace(mesh, vertices=np.concatenate([mesh.vertices, more]))


def a_stray_part_changes_nothing_but_grazing_rays(case: WildBake, power: float, seed: int) -> None:
    """A triangle joined to the target's mesh, far off, that owns no texel: too small from there to block any light."""
    scene = case.scene()
    (target,) = scene.targets
    size = max(float(np.ptp(target.mesh.vertices[target.mesh.triangles].reshape(-1, 3), axis=0).max()), 1e-3)
    way = rotation(seed)[0]
    if size * 10.0**power * float(np.abs(target.matrix).max()) > 0.5 * LARGEST:
        return
    corners = (way * size * 10.0**power + 0.1 * size * np.eye(3)).astype(np.float32)
    strewn = replace(target, mesh=_joined(target.mesh, corners))
    occluders = [strewn if each.mesh is target.mesh and each.name == target.name else each for each in scene.occluders]
    for plain, other in pairs(case, scene, replace(scene, targets=[strewn], occluders=occluders)):
        assert_array_equal(plain.covered, other.covered)
        assert within_noise(plain, other, case.rays)
        if plain.covered.any():
            difference = (plain.values - other.values)[plain.covered]
            assert abs(float(difference.mean())) <= GRAZING * max(1.0, float(plain.values.max()))


def _joined(mesh: Mesh, corners: Floats) -> Mesh:
    """With one triangle more, in one point of the texture."""
    number = np.arange(3, dtype=np.int32)[np.newaxis] + len(mesh.vertices)
    more = replace(_with_vertices(mesh, corners), triangles=np.concatenate([mesh.triangles, number]))
    if mesh.uv is not None:
        more = replace(more, uv=np.concatenate([mesh.uv, np.full((1, 3, 2), 0.5, dtype=np.float32)]))
    if mesh.normals is not None:
        upright = np.broadcast_to(np.array([0.0, 0.0, 1.0], dtype=np.float32), (1, 3, 3))
        more = replace(more, normals=np.concatenate([mesh.normals, upright]))
    return more


def alone_is_as_among_others(case: WildBake, x: float, scale: float) -> None:
    """Baked before it, after it or without it: another object's bake changes no bit."""
    scene, shift = case.scene(), np.diag([scale, scale, scale, 1.0])
    (target,) = scene.targets
    shift[0, 3] = x * max(_size(target), 1e-3) if np.isfinite(_size(target)) else 0.0
    other = replace(target, name="other target", matrix=shift @ target.matrix)
    both = replace(scene, targets=[target, other], occluders=[*scene.occluders, other])
    try:
        among = [
            list(bake(replace(both, targets=order), case.settings())) for order in ([target, other], [other, target])
        ]
    except InputError:  # of one of the two
        return
    for place, each in enumerate([target, other]):
        (alone,) = bake(replace(both, targets=[each]), case.settings())
        for baked in (among[0][place], among[1][1 - place]):
            for name, result in alone.maps.items():
                assert_array_equal(result.values, baked.maps[name].values)
                assert (result.error, result.rays) == (baked.maps[name].error, baked.maps[name].rays)


def powers_of_two_change_no_bit(case: WildBake, power: int) -> None:
    """Scene and distance together."""
    for here, there in scaled(replace(case, distance=_as_float32(case.distance)), 2.0**power):
        assert_array_equal(here.values, there.values)
        assert_array_equal(here.covered, there.covered)


def _as_float32(distance: float | None) -> float | None:
    return None if distance is None else float(np.float32(distance))


def scale_changes_nothing_but_grazing_rays(case: WildBake, factor: float) -> None:
    """Coordinates round elsewhere and directions hardly: almost all rays find the same."""
    for here, there in scaled(case, factor):
        both = here.covered & there.covered
        if both.any():
            difference = (here.values - there.values)[both]
            weight = max(1.0, float(here.values.max()))
            assert abs(float(difference.mean())) <= GRAZING * weight
            assert within_noise(here, there, case.rays)


def motion_changes_nothing_but_noise(case: WildBake, seed: int) -> None:
    """Turned, the same rays point elsewhere."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(seed)
    matrix[:3, 3] = np.random.default_rng(seed).uniform(-10, 10, 3)
    for here, there in pairs(case, case.scene(), moved(case.scene(), matrix)):
        assert within_noise(here, there, case.rays)


def within_noise(here: BakedMap, there: BakedMap, rays: int) -> bool:
    """The means over the texels differ by less than 6 sigma of independent rays, and what a grazing texel may add.

    Weights up to w make w times the noise. A texel's value may hang on rounding alone where faces coincide or cross.
    """
    both = here.covered & there.covered
    count = np.count_nonzero(both)
    if count == 0:
        return True
    a, b = here.values[both].astype(np.float64), there.values[both].astype(np.float64)
    weight = max(1.0, float(a.max()), float(b.max()))
    spread = weight * np.sqrt(2.0 * 0.25 / (rays * count))
    return bool(abs(a.mean() - b.mean()) <= 6.0 * spread + 1.0 * weight / max(count, 50))


@dataclass(frozen=True)
class WildTexels:
    """A recipe for `rasterize`. dyadic: UVs rounded to 2^-12, so that mirroring them rounds nothing."""

    uv: str
    count: int
    seed: int
    width: int
    height: int
    dyadic: bool = False

    def build(self) -> Floats:
        rng = np.random.default_rng(self.seed)
        uv = UVS[self.uv](rng, self.count)
        assert uv is not None
        return np.ascontiguousarray(np.round(uv * 4096) / 4096 if self.dyadic else uv, dtype=np.float32)


def texels_are_sound(case: WildTexels) -> None:
    """Owners exist, coverage is in [0, 1] and goes with them, threads change nothing, nothing is left out."""
    uv = case.build()
    size = (case.width, case.height)
    try:
        texels = rasterize("target", uv, *size, threads=1)
    except InputError as error:
        assert_refusal(error, "target: ")
        return
    again = rasterize("target", uv, *size, threads=3)
    assert_array_equal(texels.owner, again.owner)
    assert_array_equal(texels.coverage, again.coverage)
    assert texels.owner.min() >= -1 and texels.owner.max() < len(uv)
    assert np.isfinite(texels.coverage).all() and texels.coverage.min() >= 0.0 and texels.coverage.max() <= 1.0
    assert_array_equal(texels.coverage > 0.0, texels.covered)
    assert texels.count == np.count_nonzero(texels.covered) > 0
    by_centre = owners_by_centre(uv, *size)
    assert by_centre.min() >= -1 and by_centre.max() < len(uv)
    assert np.all(texels.covered[by_centre >= 0])


def texels_hold_the_area_of_their_triangles(case: WildTexels) -> None:
    """Coverage of charts apart adds up to their area; mirrored UVs give the mirrored image."""
    uv = np.clip(replace(case, uv="cells", dyadic=True).build(), 0.0, 1.0)
    size = (case.width, case.height)
    texels = rasterize("target", uv, *size)
    along, up = np.moveaxis(np.diff(uv.astype(np.float64), axis=1), 1, 0)
    area = 0.5 * np.abs(along[:, 0] * up[:, 1] - along[:, 1] * up[:, 0])
    shared = float(np.sum(texels.coverage, dtype=np.float64)) / (case.width * case.height)
    assert abs(shared - area.sum()) <= 1e-6 * case.count
    for axis in (0, 1):
        flipped = uv.copy()
        flipped[..., axis] = np.float32(1.0) - flipped[..., axis]
        mirror = rasterize("target", flipped, *size)
        turned = np.flip(mirror.coverage, axis=1 - axis)
        assert np.abs(turned - texels.coverage).max() <= 1e-6


@dataclass(frozen=True)
class WildImage:
    """Random values under a random mask. filler: what uncovered texels hold."""

    width: int
    height: int
    seed: int
    share: float
    filler: float = 0.0

    def build(self) -> tuple[Floats, NDArray[np.bool_]]:
        rng = np.random.default_rng(self.seed)
        covered = rng.random((self.height, self.width)) < self.share
        values = np.where(covered, rng.random(covered.shape), self.filler).astype(np.float32)
        return values, covered


def margins_stay_between(case: WildImage, pixels: int) -> None:
    """Covered texels keep their bits, the rest lies between them, and a quarter turn of the image turns it along."""
    values, covered = case.build()
    filled = fill_margin(values, covered, pixels)
    assert_array_equal(filled[covered], values[covered])
    assert np.isfinite(filled).all() and filled.dtype == np.float32
    if covered.any():
        inside = values[covered]
        assert filled.min() >= inside.min() and filled.max() <= inside.max()
    else:
        assert np.all(filled == 1.0)
    turned = fill_margin(np.rot90(values).copy(), np.rot90(covered).copy(), pixels)
    near = fill_margin(covered.astype(np.float32), np.ones_like(covered), 0)  # no texel waits: nothing changes
    assert_array_equal(near, covered.astype(np.float32))
    background = ~covered & (np.rot90(turned, -1) != filled)
    assert np.abs((np.rot90(turned, -1) - filled)[background]).max(initial=0.0) <= 1e-6  # a mean in another order


def comparisons_agree(case: WildImage, other: int) -> None:
    """Of an image with itself nothing is left; the two ways round differ by the sign of the bias."""
    (a, covered), (b, _) = case.build(), replace(case, seed=other).build()
    if not covered.any():
        return
    same, there, back = compare(a, a, covered), compare(a, b, covered), compare(b, a, covered)
    assert (same.rmse, same.bias, same.p99, same.worst) == (0.0, 0.0, 0.0, 0.0)
    assert (there.rmse, there.bias, there.p99, there.worst) == (back.rmse, -back.bias, back.p99, back.worst)
    assert there.texels == np.count_nonzero(covered)
    assert abs(there.bias) <= there.rmse * (1 + 1e-9) and there.rmse <= there.worst * (1 + 1e-9)
    assert there.p99 <= there.worst <= 1.0
    shown = comparison_image(a, b, covered)
    assert np.isfinite(shown).all() and shown.min() >= 0.0 and shown.max() <= 1.0


def images_come_back(case: WildImage, kind: tuple[str, int]) -> None:
    """To half a step of the integers, to the last bit of 32, to 2^-11 of half floats; metadata whole."""
    name, depth = kind
    values, covered = case.build()
    metadata: dict[str, str | int | float] = {"object": "Ä 'quoted' \"name\"", "rays": case.seed, "share": case.share}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"image{suffix(name)}"
        write_image(path, values, depth=depth, coverage=covered.astype(np.float32), metadata=metadata)
        assert [each.name for each in Path(folder).iterdir()] == [path.name]
        back, kept = read_image(path)
    assert kept == metadata
    assert back.shape[:2] == values.shape
    encoding = FORMATS[name].encodings[depth]
    if issubclass(encoding, np.integer):
        bound = 0.501 / np.iinfo(encoding).max
    else:
        bound = 2.0**-11 if encoding is np.float16 else 0.0
    assert np.abs(back[..., 0] - values).max() <= bound
    if FORMATS[name].has_alpha:
        assert_array_equal(back[..., -1], covered.astype(np.float32))


def a_constant_displacement_moves_vertices_along_their_normals(
    wild: WildMesh, matrix: str, height: float, smooth: bool
) -> None:
    """As a material has it in Blender, read by the add-on, whatever the mesh and its object's matrix."""
    from .displaced import displaced  # of all properties this one alone needs Blender

    mesh = wild.build("target")
    expected, found = displaced(mesh, MATRICES[matrix], height * float(np.ptp(mesh.vertices)), smooth=smooth)
    size = float(np.abs(expected).max()) + abs(height) * float(np.ptp(mesh.vertices))
    used = np.unique(mesh.triangles)
    np.testing.assert_allclose(
        found[used], expected[used], atol=5e-5 * size
    )  # Cycles' normals have 16 bits from 5.2 on


_SEEDS = st.integers(0, 999_999)
_SIDES = st.sampled_from([1, 2, 3, 5, 8, 17, 32, 64])
_texels = st.builds(
    WildTexels, st.sampled_from(sorted({*UVS} - {"none"})), st.integers(1, 40), _SEEDS, _SIDES, _SIDES, st.booleans()
)
_images = st.builds(
    WildImage,
    _SIDES,
    _SIDES,
    _SEEDS,
    st.sampled_from([0.0, 0.02, 0.3, 0.9, 1.0]),
    st.sampled_from([0.0, np.nan, np.inf, -1e30]),
)
_KINDS = [(name, depth) for name, each in FORMATS.items() for depth in each.encodings]
_finite_images = st.builds(WildImage, _SIDES, _SIDES, _SEEDS, st.sampled_from([0.0, 0.02, 0.3, 1.0]))
_moving = st.builds(
    WildMesh,
    st.sampled_from(["soup", "grid", "box", "fan"]),
    st.integers(1, 24),
    _SEEDS,
    st.lists(st.sampled_from(["needle", "large", "small", "doubled", "no area"]), max_size=1).map(tuple),
)
_within = tame_bakes.filter(lambda case: case.distance is not None)


@dataclass(frozen=True)
class Property:
    """A check, what it means and what it is called with. short, long: cases in `make test` and in the long run."""

    meaning: str
    check: Callable[..., None]
    cases: tuple[st.SearchStrategy[Any], ...]
    short: int
    long: int


PROPERTIES: dict[str, Property] = {
    each.check.__name__: each
    for each in (
        Property(
            "refused in one line that names the object or the setting, or finite and within its weights' range",
            is_sound,
            (wild_bakes,),
            150,
            3500,
        ),
        Property(
            "a larger distance never raises a value, texel by texel",
            farther_never_brightens,
            (_within, st.floats(1.0, 100.0)),
            12,
            300,
        ),
        Property(
            "one more occluder never raises a value, texel by texel",
            an_occluder_never_brightens,
            (tame_bakes, tame_objects),
            20,
            300,
        ),
        Property(
            "scene and distance scaled by a power of two: not a bit changes",
            powers_of_two_change_no_bit,
            (tame_bakes, st.integers(-20, 30)),
            20,
            300,
        ),
        Property(
            "loose vertices, however far off: not a bit changes",
            stray_vertices_change_no_bit,
            (tame_bakes, st.floats(-6.0, 30.0)),
            12,
            200,
        ),
        Property(
            "a stray triangle joined to the mesh, 10 to 10^8 sizes off: the mean by 2 % at most, by grazing rays",
            a_stray_part_changes_nothing_but_grazing_rays,
            (tame_bakes, st.floats(1.0, 8.0), _SEEDS),
            12,
            200,
        ),
        Property(
            "baked alone, before another object or after it: not a bit changes",
            alone_is_as_among_others,
            (tame_bakes, st.floats(-3.0, 3.0), st.sampled_from([1e-3, 0.5, 1.0, 30.0])),
            12,
            200,
        ),
        Property(
            "scaled by any other factor: the mean by 2 % at most, by grazing rays",
            scale_changes_nothing_but_grazing_rays,
            (tame_bakes, st.floats(0.01, 100.0)),
            12,
            200,
        ),
        Property(
            "turned and moved: nothing beyond six sigmas, and one texel",
            motion_changes_nothing_but_noise,
            (tame_bakes, _SEEDS),
            12,
            200,
        ),
        Property(
            "texels: owners exist, coverage within [0, 1], nothing left out, threads change nothing",
            texels_are_sound,
            (_texels,),
            60,
            3000,
        ),
        Property(
            "coverage adds up to the area of the triangles; mirrored UVs mirror it",
            texels_hold_the_area_of_their_triangles,
            (_texels,),
            20,
            700,
        ),
        Property(
            "margins stay between the covered values; covered texels keep their bits",
            margins_stay_between,
            (_images, st.integers(0, 20)),
            25,
            1200,
        ),
        Property(
            "comparisons: nothing with itself, the other way round the other sign",
            comparisons_agree,
            (_finite_images, _SEEDS),
            4,
            60,
        ),
        Property(
            "images come back as they were written, metadata whole",
            images_come_back,
            (_finite_images, st.sampled_from(_KINDS)),
            6,
            100,
        ),
        Property(
            "charts lie in the image, none mirrored or on another, padding kept, density even, stretch bounded",
            charts_are_sound,
            (chart_cases, st.sampled_from([64, 256]), st.sampled_from([64, 128])),
            12,
            600,
        ),
        Property(
            "a material's constant displacement moves each vertex along its normal, as the mesh so moved",
            a_constant_displacement_moves_vertices_along_their_normals,
            (_moving, st.sampled_from([*MATRICES][:6]), st.floats(-0.5, 0.5), st.booleans()),
            6,
            200,
        ),
    )
}
