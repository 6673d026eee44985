"""Directional codes of baked surfaces: cells where they are known, and RO rebuilt beside RO that was baked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.progress import Progress
from occlusion_bake.core.rays.embree import open_device
from occlusion_bake.core.rays.map_spec import AO, reflection
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.rays.trace_scene import TraceScene
from occlusion_bake.core.rays.tracer import TraceOptions, trace_cells
from occlusion_bake.core.scene.scene import Camera
from occlusion_bake.core.scene.world_mesh import world_mesh
from occlusion_bake.core.solve import directional
from occlusion_bake.core.solve.directional import DirectionalSettings
from occlusion_bake.core.spherical.directional_format import DirectionalFormat, rebuild
from occlusion_bake.core.spherical.lobe import open_horizon
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import bake_one
from occlusion_bake.tests.oracles.settings import flat_settings


@pytest.mark.parametrize("side", [8, 16])
@pytest.mark.parametrize(
    ("tangent", "sign", "open_half"),
    [
        ((1, 0, 0), 1, np.s_[:, :, 1, :]),
        ((-2, 0, 1), 1, np.s_[:, :, 0, :]),  # made upright
        ((0, 1, 0), 1, np.s_[0, :, :, :]),  # v is -x
        ((0, 1, 0), -1, np.s_[1, :, :, :]),
    ],
)
def test_beside_a_wall_half_of_the_cells_are_open(side: int, tangent: Any, sign: float, open_half: Any) -> None:
    """The wall hides all directions of x < 0: of the square, by the tangent, its left, right, lower or upper half."""
    scene, floor = TraceScene(open_device(0)), world_mesh(shapes.instance(shapes.patch()), np.zeros(3))
    for mesh in (shapes.tall_wall(-1e-3), shapes.patch()):
        copy = world_mesh(shapes.instance(mesh), np.zeros(3))
        scene.add(copy.vertices, copy.triangles)
    scene.commit()
    owner, texels = np.zeros((4, 4), dtype=np.int32), np.arange(16, dtype=np.int64)
    tangents = np.repeat(np.float32([[*tangent, sign]]), 16, axis=0)
    cells = trace_cells(scene, TexelSurface(floor, owner), texels, tangents, side, TraceOptions(1024))
    halves = np.zeros((2, side // 2, 2, side // 2))
    halves[open_half] = 1.0
    assert np.abs(cells - halves.reshape(side, side)).max() < 0.1  # a ray may graze the wall's foot
    assert abs(cells.mean() - 0.5) < 2e-3


@pytest.mark.parametrize(
    ("code", "bound"),
    [(DirectionalFormat("sh", 3), 0.03), (DirectionalFormat("cells", 16), 0.02), (DirectionalFormat("mask", 16), 0.05)],
)
@pytest.mark.parametrize("turned", [False, True])
def test_rebuilt_for_a_camera_it_is_what_is_baked_for_it(
    code: DirectionalFormat,
    bound: float,
    turned: bool,
) -> None:
    matrix = shapes.matrix((2, 3, -1), (1, -1, 1) if turned else 1.0, turned)
    view = np.array([0.6, -0.3, -1.0]) / np.linalg.norm([0.6, -0.3, -1.0])
    forward = matrix[:3, :3] @ view
    camera = Camera((0, 0, 0), tuple(forward / np.linalg.norm(forward)), orthographic=True)
    scene = shapes.scene(
        shapes.with_tangents(shapes.plane(1.0, name="floor")),
        shapes.sphere((0.2, 0.1, 0.6), 0.5, 48),
        under=matrix,
        camera=camera,
    )
    settings = {"maps": (reflection(10, from_camera=True),), "code": DirectionalSettings(code, 1024)}
    baked = bake_one(scene, size=32, rays=1024, **settings)
    made = baked.maps[code.name]
    reflected = np.array([view[0], view[1], -view[2]])
    values = made.values[made.covered]
    rebuilt = rebuild(values, code, np.repeat(reflected[None], len(values), axis=0), 10.0)
    truth = baked.maps["ro_10"].values[made.covered]
    assert np.sqrt(np.mean((rebuilt - truth) ** 2)) < bound
    assert 0.2 < truth.min() + 0.2 < truth.max()
    assert 0.0 < made.error < bound


def test_in_the_open_it_is_the_open_horizon() -> None:
    code = DirectionalFormat("sh", 3)
    scene = shapes.scene(shapes.with_tangents(shapes.plane(1.0)))
    made = bake_one(scene, maps=(), code=DirectionalSettings(code)).maps["sh_3"]
    assert made.values.shape == (16, 16, 16)
    ways = np.array([[np.sin(angle), 0.0, np.cos(angle)] for angle in (0.0, 0.7, 1.4)])
    for way in ways:
        rebuilt = rebuild(made.values.reshape(-1, 16), code, np.repeat(way[None], 256, axis=0), 20.0)
        np.testing.assert_allclose(rebuilt, open_horizon(20.0, way[2]), atol=1e-4)


@pytest.mark.parametrize("others", [(), (AO,)])
def test_the_bar_goes_on_through_its_bands_to_the_end(others: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(directional, "_BAND", 300)

    class Watched(Progress):
        def enter(self, stage: str, share: tuple[float, float] = (0.0, 0.0), *, rays: bool = False) -> Any:
            if "code" in stage:
                shares.append(share)
            return super().enter(stage, share, rays=rays)

    shares: list[tuple[float, float]] = []
    settings = flat_settings(others, width=32, height=32, rays=4, code=DirectionalSettings(DirectionalFormat("sh", 3)))
    list(bake(shapes.scene(shapes.with_tangents(shapes.patch())), settings, Watched()))
    starts, ends = np.transpose(shares)
    assert len(shares) == 4 and ends[-1] == 1.0 and np.all(starts < ends)
    np.testing.assert_allclose(starts[1:], ends[:-1])


def test_wrong_rays_and_missing_tangents_are_refused() -> None:
    for rays in (0, 128, 300, 1 << 20):
        with pytest.raises(InputError, match="power of two"):
            DirectionalSettings(DirectionalFormat("sh", 3), rays)
    with pytest.raises(InputError, match="patch: it has no tangents"):
        bake_one(shapes.scene(shapes.patch()), code=DirectionalSettings(DirectionalFormat("sh", 3)))
