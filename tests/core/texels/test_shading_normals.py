"""Normal maps turn the normals that a bake is about: a leaning floor, mirrored and turned, halves of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.bake import Baker, bake
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.maps.bent_normals import BentNormalMap, Space
from occlusion_bake.core.progress import Progress
from occlusion_bake.core.rays.map_spec import AO, reflection
from occlusion_bake.core.scene.image_texture import ImageTexture
from occlusion_bake.core.scene.normal_map import PLAIN, NormalMap, NormalMapLayer
from occlusion_bake.core.scene.scene import Mesh, Scene
from occlusion_bake.core.texels import shading_normals
from occlusion_bake.core.texels.vertex_bake import corner_image, corner_values, with_corner_cells
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

LEANING = np.array([0.6, 0.0, 0.8])  # along tangent, bitangent and normal


def layer(mesh: Mesh, vectors: Any, strength: float = 1.0, *, linear: bool = True) -> NormalMapLayer:
    """A map of (h, w, 3) vectors, or one."""
    colours = 0.5 * np.float32(vectors) + np.float32(0.5)
    assert mesh.tangents is not None
    texture = ImageTexture(colours.reshape((1, 1, 3) if colours.ndim == 1 else colours.shape), linear)
    return NormalMapLayer(texture, mesh.tangents, strength)


def mapped(scene: Scene, layers: Sequence[NormalMapLayer], which: Sequence[int] = (0, 0), uv: Any = None) -> Scene:
    (target,) = scene.targets
    places = target.mesh.uv if uv is None else uv
    made = replace(target, normal_map=NormalMap(layers, np.int32(which), np.ascontiguousarray(places)))
    return replace(scene, targets=[made], occluders=[made, *scene.occluders[1:]])


def floor(matrix: Any = None, tangent: Any = (1, 0, 0), sign: float = 1.0) -> Any:
    """A square, and its mesh. What looks down through it, as through all open sheets, meets a backing."""
    mesh = shapes.with_tangents(shapes.plane(1.0, name="floor"), tangent, sign)
    return shapes.scene(mesh, shapes.plane(4096.0, -1e-3, "backing", up=-1.0), under=matrix), mesh


def baked(scene: Scene, **settings: Any) -> Any:
    (made,) = bake(scene, flat_settings(**{"width": 16, "height": 16, "rays": 1024, "normal_maps": True, **settings}))
    return made


def test_a_leaning_normal_sees_the_floor() -> None:
    """The mean over the cosine lobe of what is above a plane: (1 + cos) / 2. Without the setting nothing changes."""
    scene, mesh = floor()
    leaning = mapped(scene, [layer(mesh, LEANING)])
    made = baked(leaning).maps["ao"]
    np.testing.assert_allclose(made.values[made.covered], 0.9, atol=0.01)
    assert made.mean == pytest.approx(0.9, abs=1e-3)
    plain = baked(leaning, normal_maps=False)
    np.testing.assert_array_equal(plain.maps["ao"].values, baked(scene).maps["ao"].values)


@pytest.mark.parametrize("exponent", [1.0, 4.0])
def test_a_lobe_goes_about_it(exponent: float) -> None:
    """Against the lobe summed over the sphere."""
    scene, mesh = floor()
    z = np.linspace(-1, 1, 2001)[:, None]
    turn = np.linspace(0, 2 * np.pi, 721)[None, :-1]
    radius = np.sqrt(1 - z**2)
    leaning = LEANING[[2, 1, 0]]  # more
    cosine = np.maximum(leaning[0] * radius * np.cos(turn) + leaning[2] * z, 0.0) ** exponent
    exact = float(cosine[np.broadcast_to(z > 0, cosine.shape)].sum() / cosine.sum())
    made = baked(mapped(scene, [layer(mesh, leaning)]), maps=(reflection(exponent),))
    (ro,) = made.maps.values()
    assert ro.mean == pytest.approx(exact, abs=2e-3) and exact < 0.99


@pytest.mark.parametrize(
    ("tangent", "sign", "mirrored"), [((1, 0, 0), 1, False), ((0, 1, 0), 1, False), ((1, 0, 0), -1, False),
                                      ((1, 0, 0), 1, True)],
)  # fmt: skip
def test_it_leans_where_the_tangent_says(tangent: Any, sign: float, mirrored: bool) -> None:
    """In the open the mean direction of the cosine lobe, cut by the floor, lies in the plane of both normals; beside
    the floor's normal it leans to the map's side."""
    scale = (-1, 1, 1) if mirrored else 1.0
    matrix = shapes.matrix((1, 2, 3), scale, True)
    scene, mesh = floor(matrix, tangent, sign)
    along = np.array([0.48, 0.36, 0.8])
    made = baked(mapped(scene, [layer(mesh, along)]), bent=BentNormalMap(Space.OBJECT)).maps["bent"]
    bent = (2.0 * made.values[made.covered] - 1.0).mean(axis=0)
    bitangent = sign * np.cross((0, 0, 1), tangent)
    normal = along[0] * np.array(tangent) + along[1] * bitangent + along[2] * np.array([0, 0, 1])
    across = normal - (0, 0, normal[2])
    assert bent[:2] @ across[:2] / (np.linalg.norm(bent[:2]) * np.linalg.norm(across)) > 0.999
    assert 0.3 < np.linalg.norm(bent[:2]) < 0.6


def test_each_texel_takes_its_own_part_of_the_picture() -> None:
    """The right half leans; a finer picture than the bake counts by its mean, a coarser one is interpolated."""
    scene, mesh = floor()
    for size in (2, 16, 64):
        vectors = np.zeros((size, size, 3))
        vectors[:, : size // 2], vectors[:, size // 2 :] = (0, 0, 1), LEANING
        made = baked(mapped(scene, [layer(mesh, vectors, linear=size > 2)])).maps["ao"].values
        np.testing.assert_allclose(made[:, 2:7], 1.0, atol=1e-3)
        np.testing.assert_allclose(made[:, 9:14], 0.9, atol=0.02)


def test_what_varies_within_a_texel_is_averaged() -> None:
    """Left and right in turns: the mean normal stands upright."""
    scene, mesh = floor()
    vectors = np.zeros((64, 64, 3))
    vectors[:, 0::2], vectors[:, 1::2] = LEANING, LEANING * (-1, 1, 1)
    made = baked(mapped(scene, [layer(mesh, vectors, linear=False)])).maps["ao"]
    np.testing.assert_allclose(made.values[2:-2, 2:-2], 1.0, atol=5e-3)


def test_strength() -> None:
    """As Cycles has it: x and y times the strength, z towards 1 by at most as much."""
    scene, mesh = floor()
    for strength in (0.0, 0.5, 2.0):
        vector = LEANING * (strength, strength, 1.0)
        vector[2] = 1.0 + (LEANING[2] - 1.0) * min(strength, 1.0)
        cosine = vector[2] / np.linalg.norm(vector)
        made = baked(mapped(scene, [layer(mesh, LEANING, strength)])).maps["ao"]
        assert made.mean == pytest.approx(0.5 + 0.5 * cosine, abs=1e-3)


def test_triangles_without_a_map_and_colours_of_no_length_keep_their_normals() -> None:
    scene, mesh = floor()
    plain = mapped(scene, [layer(mesh, LEANING)], (PLAIN, PLAIN))
    none = mapped(scene, [layer(mesh, (0, 0, 0))])
    for each in (plain, none):
        assert baked(each).maps["ao"].mean == 1.0


def test_places_that_are_no_numbers_keep_their_normals() -> None:
    scene, mesh = floor()
    assert mesh.uv is not None
    uv = mesh.uv.copy()
    uv[0, 1] = np.nan
    made = baked(mapped(scene, [layer(mesh, LEANING)], uv=uv)).maps["ao"]
    assert made.values[-2, -4] == 1.0  # of the first triangle
    assert made.values[2, 4] == pytest.approx(0.9, abs=0.02)


def test_it_can_be_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, mesh = floor()
    progress = Progress()
    monkeypatch.setattr(shading_normals, "_normals", lambda *_: progress.cancel())
    monkeypatch.setattr(shading_normals, "_BAND", 8)
    settings = flat_settings(width=16, height=16, rays=4, normal_maps=True, threads=1)
    with pytest.raises(Cancelled):
        list(bake(mapped(scene, [layer(mesh, LEANING)]), settings, progress))


@pytest.mark.parametrize("filtered", [True, False])
def test_the_filter_knows_what_normals_explain(filtered: bool) -> None:
    """On an open floor AO is linear in the normal: with it a fit leaves a quarter of the noise."""
    scene, mesh = floor()
    v, u = (np.indices((64, 64), dtype=np.int64) + 0.5) / 64
    vectors = np.stack([0.6 * np.sin(12 * np.pi * u), 0.6 * np.sin(16 * np.pi * v), np.ones_like(u)], axis=2)
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    made = baked(mapped(scene, [layer(mesh, vectors, linear=False)]), width=64, height=64, rays=16, filtered=filtered)
    ao = made.maps["ao"]
    off = ao.values - (0.5 + 0.5 * vectors[..., 2])
    assert vectors[..., 2].std() > 0.05
    if filtered:
        assert np.sqrt(np.mean(off**2)) < 0.012 and ao.error < 0.012  # by place alone 0.023
    else:
        assert np.sqrt(np.mean(off**2)) > 0.03


def test_it_lies_where_its_own_uvs_say_in_tiles_and_at_corners() -> None:
    """However the bake is laid out, the half of the floor over x > 0 leans."""
    scene, mesh = floor()
    vectors = np.zeros((64, 64, 3))
    vectors[:, :32], vectors[:, 32:] = (0, 0, 1), LEANING
    assert mesh.uv is not None
    in_tile = replace(mesh, uv=(mesh.uv + np.float32([1.0, 0.0])).astype(np.float32))
    instance = replace(scene.targets[0], mesh=in_tile)
    moved = replace(scene, targets=[instance], occluders=[instance, *scene.occluders[1:]])
    settings = flat_settings(width=16, height=16, rays=1024, normal_maps=True)
    laid = mapped(moved, [layer(in_tile, vectors)], uv=mesh.uv)
    ao = Baker(laid, settings).bake(laid.targets[0], 1002).maps["ao"].values
    np.testing.assert_allclose(ao[:, 2:7], 1.0, atol=1e-3)
    np.testing.assert_allclose(ao[:, 9:14], 0.9, atol=0.02)
    laid = mapped(scene, [layer(mesh, vectors)])
    cells = with_corner_cells(laid)
    baked_cells = Baker(cells, settings).bake(cells.targets[0], size=corner_image(len(mesh.triangles)))
    corners = corner_values(baked_cells.maps["ao"].values, mesh)
    leaning = mesh.vertices[mesh.triangles][..., 0] > 0.0
    assert corners[leaning].max() < 0.95 < 0.98 < corners[~leaning].min()


def test_arrays_that_do_not_fit_are_refused() -> None:
    scene, mesh = floor()
    with pytest.raises(InputError, match="normal map: UVs"):
        NormalMap([layer(mesh, LEANING)], np.zeros(2, np.int32), np.zeros((3, 3, 2), np.float32))
    with pytest.raises(InputError, match="there are 1"):
        NormalMap([layer(mesh, LEANING)], np.ones(2, np.int32), np.zeros((2, 3, 2), np.float32))
    with pytest.raises(InputError, match="floor: a normal map of 3 triangles"):
        baked(mapped(scene, [layer(mesh, LEANING)], (0, 0, 0), np.zeros((3, 3, 2), np.float32)))
    assert AO.name in baked(scene).maps  # a mesh without a map is baked as it is
