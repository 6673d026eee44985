"""A second opinion: occlusion by another tracer, on other points, along other directions, in float64.

Nothing of the kernel is used. The tree and the triangle test are libigl's (https://libigl.github.io), which has no
Embree in this path; places, normals and directions come from numpy's own generator. It is some thirty times as slow.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import igl
import numpy as np

from ...core.base.arrays import Doubles, Flags, Ints, Longs
from ...core.rays.embree import open_device
from ...core.rays.map_spec import AO, Axis, MapSpec, reflection
from ...core.rays.occluders import Occluders
from ...core.rays.ray_options import RayOptions
from ...core.rays.texel_surface import TexelSurface
from ...core.rays.tracer import TraceOptions, trace
from ...core.scene.checks import zero_area
from ...core.scene.scene import Camera, Instance, Scene
from ...core.scene.world_mesh import bounds_of, centre_of, world_surface
from ...core.texels.rasterize import rasterize

STRATA = 16  # along a side of the square that a texel's rays are drawn from
REPLICAS = 8  # independent sets of STRATA² rays a texel, which tell their own noise
SEEDS, RAYS = 16, 128  # of the kernel's
LIFT = 2.0**-36  # how far off the surface rays start, in units of the largest coordinate; ours 2⁻²⁰
LARGE = 2.0**40  # libigl leaves out triangles by an absolute bound on their area, so that the scene is made large
BATCH = 1 << 18  # rays at a time
LIMIT = 0.1  # of the object's diagonal, where the distance is limited
TRIES = 400  # to hit the triangle within a texel: enough where it covers a fortieth of it


# What is asked of a scene, and whether with limited rays.
QUESTIONS: dict[str, tuple[MapSpec, bool]] = {
    "AO": (AO, False),
    "RO 10": (reflection(10.0), False),
    "RO 100": (reflection(100.0), False),
    "RO 10, camera": (reflection(10.0, from_camera=True), False),
    "RO 100, camera": (reflection(100.0, from_camera=True), False),
    "AO, limited": (AO, True),
    "RO 10, limited": (reflection(10.0), True),
}


class Tracer:
    """Occluders in world space about `origin` ((3,) float64), in libigl's tree of float64 boxes."""

    def __init__(self, occluders: Sequence[Instance], origin: Doubles) -> None:
        parts = [_world(instance, origin) for instance in occluders]
        starts = np.cumsum([0, *(len(part) for part in parts[:-1])])
        triangles = [each.mesh.triangles + start for each, start in zip(occluders, starts, strict=True)]
        self.vertices = np.concatenate(parts)
        self.triangles = np.concatenate(triangles).astype(np.int64)
        self._scale = LARGE / float(np.abs(self.vertices).max())
        self._scaled = np.ascontiguousarray(self.vertices * self._scale)
        self._tree = igl.AABB()
        self._tree.init(self._scaled, self.triangles)

    def visible(self, origins: Doubles, directions: Doubles, distance: float = np.inf) -> Flags:
        """V along rays: (N, 3) float64 places and unit directions → (N,) bool, True where nothing is hit."""
        reach = distance * self._scale
        hit, _, _ = self._tree.intersect_ray_first(
            self._scaled, self.triangles, origins * self._scale, directions, reach
        )
        return np.asarray(hit) < 0


def _world(instance: Instance, origin: Doubles) -> Doubles:
    linear, shift = instance.matrix[:3, :3], instance.matrix[:3, 3]
    moved: Doubles = instance.mesh.vertices.astype(np.float64) @ linear.T + (shift - origin)
    return moved


@dataclass(frozen=True, eq=False)
class Texels:
    """Some texels of a target, each with its triangle, about the same origin as the tracer's.

    place: (N, 2), the texel's left and top. corners: (N, 3, 2), of its triangle in the image, in texels. positions,
    normals: (N, 3, 3), of those corners. geometric: (N, 3), the triangle's normal, outward under any transform.
    """

    place: Doubles
    corners: Doubles
    positions: Doubles
    normals: Doubles
    geometric: Doubles

    def part(self, chosen: slice) -> Texels:
        """Some of them."""
        return Texels(
            *(each[chosen] for each in (self.place, self.corners, self.positions, self.normals, self.geometric))
        )


def texels_of(target: Instance, owner: Ints, x: Longs, y: Longs, origin: Doubles) -> Texels:
    """Texels (x, y) of the image whose owners these are, (H, W), row 0 the top."""
    mesh, triangle = target.mesh, owner[y, x]
    assert mesh.uv is not None
    height, width = owner.shape
    corners = mesh.uv[triangle].astype(np.float64) * (width, -height) + (0.0, height)
    positions = _world(target, origin)[mesh.triangles[triangle]]
    across = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    geometric = _unit(across * np.sign(np.linalg.det(target.matrix[:3, :3])))
    if mesh.normals is None:
        normals = np.repeat(geometric[:, np.newaxis], 3, axis=1)
    else:
        normals = _unit(mesh.normals[triangle].astype(np.float64) @ np.linalg.inv(target.matrix[:3, :3]))
    return Texels(np.column_stack([x, y]).astype(np.float64), corners, positions, normals, geometric)


def _unit(vectors: Doubles) -> Doubles:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Doubles = vectors / np.where(length > 0.0, length, 1.0)
    return unit


@dataclass(frozen=True, eq=False)
class Estimate:
    """Means of rays: value and variance of it, (N,) float64; NaN for a texel that its triangle hardly covers.

    toward: (N,) the share of the rays' places that face the camera, 1 where R is the normal.
    """

    value: Doubles
    variance: Doubles
    toward: Doubles


def estimate(
    tracer: Tracer,
    texels: Texels,
    estimator: MapSpec,
    rng: np.random.Generator,
    *,
    distance: float = np.inf,
    camera: Camera | None = None,
    lift: float = LIFT,
) -> Estimate:
    """The estimator's map by REPLICAS times STRATA² rays a texel. camera: about the origin that the texels have."""
    step = max(1, BATCH // (REPLICAS * STRATA**2))
    parts = []
    for start in range(0, len(texels.place), step):
        some = texels.part(slice(start, start + step))
        weights = _weights(some, rng)
        positions = np.einsum("nkc,ncx->nkx", weights, some.positions)
        normals = _unit(np.einsum("nkc,ncx->nkx", weights, some.normals))
        axes, facing = _axes(estimator, positions, normals, camera)
        directions = _around(axes, estimator.exponent, rng)
        above = np.einsum("nkx,nkx->nk", directions, normals) > 0.0
        side = np.sign(np.einsum("nkx,nx->nk", directions, some.geometric))
        off = lift * np.abs(some.positions).max(axis=(1, 2))
        origins = positions + (side * off[:, np.newaxis])[..., np.newaxis] * some.geometric[:, np.newaxis]
        seen = tracer.visible(origins.reshape(-1, 3), directions.reshape(-1, 3), distance)
        means = (seen.reshape(above.shape) & above).reshape(len(above), REPLICAS, -1).mean(axis=2)
        means[np.isnan(weights).any(axis=(1, 2))] = np.nan
        parts.append((means.mean(axis=1), means.var(axis=1, ddof=1) / REPLICAS, facing.mean(axis=1)))
    return Estimate(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _weights(texels: Texels, rng: np.random.Generator) -> Doubles:
    """(N, K, 3) barycentric weights of places spread evenly over each texel's part of its triangle, by rejection."""
    count = len(texels.place)
    weights = np.full((count, REPLICAS * STRATA**2, 3), np.nan)
    a, edge1, edge2 = (texels.corners[:, 0], *(texels.corners[:, i] - texels.corners[:, 0] for i in (1, 2)))
    area = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
    for _ in range(TRIES):
        texel, ray = np.nonzero(np.isnan(weights[..., 0]))
        if not len(texel):
            break
        to = texels.place[texel] + rng.random((len(texel), 2)) - a[texel]
        second = (to[:, 0] * edge2[texel, 1] - to[:, 1] * edge2[texel, 0]) / area[texel]
        third = (edge1[texel, 0] * to[:, 1] - edge1[texel, 1] * to[:, 0]) / area[texel]
        inside = (second >= 0.0) & (third >= 0.0) & (second + third <= 1.0)
        found = np.column_stack([1.0 - second - third, second, third])
        weights[texel[inside], ray[inside]] = found[inside]
    return weights


def _axes(estimator: MapSpec, positions: Doubles, normals: Doubles, camera: Camera | None) -> tuple[Doubles, Flags]:
    """The lobe's axis at every place, and whether the place faces the camera."""
    if estimator.axis is Axis.NORMAL:
        return normals, np.ones(normals.shape[:2], dtype=np.bool_)
    assert camera is not None
    if camera.orthographic:
        view = np.broadcast_to(np.asarray(camera.forward, dtype=np.float64), positions.shape)
    else:
        view = _unit(positions - np.asarray(camera.position, dtype=np.float64))
    against = -np.sum(view * normals, axis=-1, keepdims=True)
    return view + 2.0 * against * normals, against[..., 0] > 0.0


def _around(axes: Doubles, exponent: float, rng: np.random.Generator) -> Doubles:
    """(N, K, 3) unit directions of density (e+1)/(2π) cosᵉ about (N, K, 3) axes; each replica's rays jittered."""
    count = len(axes)
    row, column = np.divmod(np.arange(STRATA**2, dtype=np.int64), STRATA)
    square = (np.stack([row, column], axis=1) + rng.random((count, REPLICAS, STRATA**2, 2))) / STRATA
    u, v = square.reshape(count, -1, 2).transpose(2, 0, 1)
    cosine = (1.0 - u) ** (1.0 / (exponent + 1.0))
    sine, turn = np.sqrt(1.0 - cosine**2), 2.0 * np.pi * v
    least = np.eye(3)[np.abs(axes).argmin(axis=2)]
    tangent = _unit(np.cross(axes, least))
    bitangent = np.cross(axes, tangent)
    directions: Doubles = (
        (sine * np.cos(turn))[..., np.newaxis] * tangent
        + (sine * np.sin(turn))[..., np.newaxis] * bitangent
        + cosine[..., np.newaxis] * axes
    )
    return directions


@dataclass(frozen=True)
class Agreement:
    """Ours minus the second opinion over some texels.

    bias: the mean, bias_error: its standard error. rmse: of the texels, expected: what the noise of both would give.
    excess: mean square beyond that noise, excess_error: its standard error. facing: texels of which one says that they
    face the camera with all their places, and the other that they do not. dropped: hardly covered by their triangle.
    """

    texels: int
    bias: float
    bias_error: float
    rmse: float
    expected: float
    excess: float
    excess_error: float
    facing: int
    dropped: int

    @property
    def sigmas(self) -> tuple[float, float]:
        """How many standard errors bias and excess are off zero."""
        tiny = 1e-12  # where all agree on the same number
        return self.bias / (self.bias_error + tiny), self.excess / (self.excess_error + tiny)


def ask(
    scene: Scene,
    target: Instance,
    owner: Ints,
    estimators: Sequence[MapSpec],
    *,
    count: int,
    distance: float = np.inf,
    seed: int = 0,
    lift: float = LIFT,
) -> Iterator[Agreement]:
    """Bake `count` random texels of the target by the kernel and by the second opinion: an answer an estimator."""
    rng = np.random.default_rng(seed)
    rows, columns = np.nonzero(owner >= 0)
    chosen = rng.permutation(len(rows))[:count]
    y, x = rows[chosen], columns[chosen]
    origin = centre_of(target)
    tracer, texels = Tracer(scene.occluders, origin), texels_of(target, owner, x, y, origin)
    ours = _ours(scene, target, owner, x, y, estimators, distance)
    camera = _moved(scene.camera, origin)
    for index, estimator in enumerate(estimators):
        theirs = estimate(tracer, texels, estimator, rng, distance=distance, camera=camera, lift=lift)
        yield agreement(ours[:, index], theirs)


def answers(scene: Scene, size: int, count: int) -> Iterator[tuple[str, Agreement]]:
    """QUESTIONS about so many texels of the first target's texture, of size × size: their names and the answers."""
    target = scene.targets[0]
    assert target.mesh.uv is not None
    owner = rasterize(target.name, target.mesh.uv, size, size, skip=zero_area(target.mesh)).owner
    low, high = bounds_of(target)
    for limited in (False, True):
        asked = {name: estimator for name, (estimator, short) in QUESTIONS.items() if short == limited}
        reach = LIMIT * float(np.linalg.norm(high - low)) if limited else math.inf
        yield from zip(asked, ask(scene, target, owner, [*asked.values()], count=count, distance=reach), strict=True)


def agreement(ours: Doubles, theirs: Estimate) -> Agreement:
    """ours: (S, N), a row a seed, NaN where a texel faces away from the camera."""
    away = np.isnan(ours).any(axis=0)
    dropped = np.isnan(theirs.value)
    facing = int(np.count_nonzero((away & (theirs.toward == 1.0)) | (~away & (theirs.toward == 0.0))))
    used = ~away & ~dropped
    seeds, texels = len(ours), int(np.count_nonzero(used))
    difference = ours[:, used].mean(axis=0) - theirs.value[used]
    variance = ours[:, used].var(axis=0, ddof=1) / seeds + theirs.variance[used]
    # Seeds are independent, the texels of one are not; those of the second opinion are.
    bias_variance = ours[:, used].mean(axis=1).var(ddof=1) / seeds + theirs.variance[used].sum() / texels**2
    beyond = difference**2 - variance
    return Agreement(
        texels,
        float(difference.mean()),
        float(np.sqrt(bias_variance)),
        float(np.sqrt(np.mean(difference**2))),
        float(np.sqrt(variance.mean())),
        float(beyond.mean()),
        float(beyond.std(ddof=1) / np.sqrt(texels)),
        facing,
        int(np.count_nonzero(dropped)),
    )


def _ours(
    scene: Scene,
    target: Instance,
    owner: Ints,
    x: Longs,
    y: Longs,
    estimators: Sequence[MapSpec],
    distance: float,
) -> Doubles:
    """(S, M, N) float64: the texels' values by the kernel, a row a seed; NaN where they face away from the camera."""
    alone = np.full_like(owner, -1)
    alone[y, x] = owner[y, x]
    limits = RayOptions(distance if math.isfinite(distance) else None)
    frame = Occluders(open_device(), scene.occluders, limits).frame_for(target)
    surface = TexelSurface(world_surface(target, frame.origin), alone)
    camera = scene.camera and scene.camera.about(frame.origin)
    values = []
    for seed in range(SEEDS):
        options = TraceOptions(RAYS, seed, limits, camera=camera)
        values.append(trace(frame.scene, surface, estimators, options, halves=False).all[:, y, x])
    sums = np.array(values, dtype=np.float64)
    return np.where(sums < 0.0, np.nan, sums / RAYS)


def _moved(camera: Camera | None, origin: Doubles) -> Camera | None:
    """The second opinion's own: it shares no code with what it judges."""
    if camera is None:
        return None
    x, y, z = np.asarray(camera.position, dtype=np.float64) - origin
    return Camera((float(x), float(y), float(z)), camera.forward, camera.orthographic)
