"""The picture of a chart layout: the sheet, a checker on the mesh, its AO baked by it, side by side."""

from __future__ import annotations

import colorsys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from PIL import Image

from ...addon.charts.base_mesh import base_triangles
from ...addon.charts.uv_maps import write_uv
from ...addon.read.mesh_arrays import positions_of
from ...addon.typed import mesh_of, scene_in
from ...core.base.arrays import Doubles, Floats, Longs
from ...core.rays.map_spec import AO
from ...core.texels.rasterize import rasterize
from ...samples import stage
from ...samples.bench_scenes import stand_on_ground
from ...tests.oracles.charts.judge import charts_of
from ...tests.oracles.charts.polygon_mesh import PolygonMesh
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..shine import shine

PANEL = 360  # pixels a side
CHECK = 32  # texels a side of a square
COLOURS = 96  # of the file
_TEXELS, _RAYS, _FINER = 1024, 64, 2  # _FINER: pixels of a sheet that become one, along each side
_GOLD = 0.5 * (np.sqrt(5.0) - 1.0)
_PAPER, _INK = 1.0, 0.25
_BEHIND = np.array([0.66, 0.70, 0.75])  # what lies before it may be white
_FROM = np.array([0.45, -1.0, 0.5])  # the right, the front, above


def draw(obj: bpy.types.Object, mesh: PolygonMesh, uv: Floats, path: Path) -> None:
    """Write the picture as a PNG; gives the object the UVs, and materials. uv: (T, 3, 2), by `base_triangles`."""
    write_uv(bpy.context, obj, "Charts", uv, base_triangles(bpy.context, obj).loops)
    mesh_of(obj).uv_layers.active = mesh_of(obj).uv_layers["Charts"]
    chart = charts_of(mesh, uv)
    ao = _baked(obj.name)
    checker = _filled(_tinted(uv, chart, _TEXELS), rounds=3) * _squares(_TEXELS)
    panels = [_sheet(uv, chart), _seen(obj, checker * ao[..., None]), _seen(obj, np.repeat(ao[..., None], 3, axis=2))]
    gap = np.full((PANEL, 6, 3), _PAPER)
    row = np.concatenate([panels[0], gap, panels[1], gap, panels[2]], axis=1)
    picture = Image.fromarray(np.uint8(np.clip(255.0 * row + 0.5, 0, 255)))
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def _baked(name: str) -> Doubles:
    """(H, W) AO of the object on a ground, row 0 at the top."""
    stand_on_ground(scene_in(bpy.context), bpy.data.objects[name])
    settings = flat_settings((AO,), width=_TEXELS, height=_TEXELS, rays=_RAYS, margin=8)
    return bake_here([name], settings).baked.maps[AO.name].values.astype(np.float64)


def _sheet(uv: Floats, chart: Longs) -> Doubles:
    """(PANEL, PANEL, 3): the charts with their borders on paper."""
    side = PANEL * _FINER
    tinted = _tinted(uv, chart, side)
    bare = np.isnan(tinted[..., 0])
    near = np.pad(bare, 1, constant_values=True)
    border = ~bare & (near[2:, 1:-1] | near[:-2, 1:-1] | near[1:-1, 2:] | near[1:-1, :-2])
    drawn = np.where(bare[..., None], _PAPER, tinted)
    drawn[border] *= _INK
    shrunk: Doubles = drawn.reshape(PANEL, _FINER, PANEL, _FINER, 3).mean(axis=(1, 3))
    return shrunk


def _tinted(uv: Floats, chart: Longs, side: int) -> Doubles:
    """(side, side, 3): each chart in its colour, NaN where there is none."""
    owner = rasterize("mesh", uv, side, side).owner
    hues = (_GOLD * np.arange(int(chart.max()) + 1)) % 1.0
    palette = np.array([colorsys.hsv_to_rgb(hue, 0.45, 0.95) for hue in hues])
    return np.where((owner >= 0)[..., None], palette[chart[np.maximum(owner, 0)]], np.nan)


def _filled(image: Doubles, rounds: int) -> Doubles:
    """What lies beside a colour gets it, so often; the rest is grey."""
    for _ in range(rounds):
        for axis in (0, 1):
            for step in (-1, 1):
                moved = np.roll(image, step, axis=axis)
                image = np.where(np.isnan(image), moved, image)
    return np.nan_to_num(image, nan=0.5)


def _squares(side: int) -> Doubles:
    """(side, side, 1): light and dark squares."""
    number = np.arange(side) // CHECK
    return np.where((number[:, None] + number) % 2 == 0, 1.0, 0.72)[..., None]


def _seen(obj: bpy.types.Object, texture: Doubles) -> Doubles:
    """(PANEL, PANEL, 3): the object, with a texture (H, W, 3), row 0 at the top, that shines."""
    shine(obj, texture)
    scene: Any = scene_in(bpy.context)
    _look_at(scene, obj)
    scene.render.engine, scene.render.film_transparent = "CYCLES", True
    scene.render.resolution_x = scene.render.resolution_y = PANEL
    scene.render.resolution_percentage = 100
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 16, False, 0
    scene.view_settings.view_transform, scene.view_settings.look = "Raw", "None"
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGBA", "16"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "seen.png")
        bpy.ops.render.render(write_still=True)
        return _on_ground(Path(scene.render.filepath))


def _on_ground(file: Path) -> Doubles:
    pixels = np.asarray(Image.open(file).convert("RGBA"), dtype=np.float64) / 255.0
    laid: Doubles = pixels[..., :3] * pixels[..., 3:] + _BEHIND * (1.0 - pixels[..., 3:])
    return laid


def _look_at(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """A camera without perspective that just holds the object; nothing else is rendered."""
    for other in scene.objects:
        other.hide_render = other != obj
    turn = Vector((-_FROM).tolist()).to_track_quat("-Z", "Y")
    axes, matrix = np.array(turn.to_matrix()), np.array(obj.matrix_world)
    seen = (positions_of(mesh_of(obj)) @ matrix[:3, :3].T + matrix[:3, 3]) @ axes  # right, up, towards the camera
    low, high = seen.min(axis=0), seen.max(axis=0)
    size = float((high - low).max())
    camera = bpy.data.cameras.new("Sheet")
    camera.type, camera.ortho_scale, camera.clip_end = "ORTHO", 1.06 * float((high - low)[:2].max()), 4.0 * size
    middle = np.append(0.5 * (low + high)[:2], high[2] + size)
    scene.camera = stage.add(scene, "Sheet", camera, at=tuple((axes @ middle).tolist()))
    scene.camera.rotation_euler = turn.to_euler()
