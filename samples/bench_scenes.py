"""The scenes that bakers are compared on: the samples, scenes of a kind that those lack, and models from files."""

from __future__ import annotations

from collections.abc import Callable
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..addon.cli.import_file import load
from ..addon.typed import mesh_of, scene_in
from ..core.base.arrays import Doubles
from . import character, decimated, housing, props, shapes, stage
from .scenes import SCENES as SAMPLES
from .stage import Sample

if TYPE_CHECKING:  # there is none before bpy
    from bmesh.types import BMesh

Build = Callable[[bpy.types.Scene], Sample]

CLEAR = 0.0005  # metres between things that stand on each other
SCULPT_SIDE = 1001  # points along a side of the net: 2 million triangles
GAPS = (0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064)  # metres
STONES = 100  # along a side
_GAP = 1e-3  # of a model's height, between it and the ground: faces that coincide are a question of their own
_GROUND = 8.0  # the ground's sides, in diagonals of the model
_OCTAVES = ((2.0, 0.25, 3), (5.0, 0.16, 4), (13.0, 0.07, 5), (34.0, 0.03, 6), (90.0, 0.012, 7))  # waves, height, seed


def build(name: str, models: Path) -> Sample:
    """Replace whatever file is open by a scene, from Blender's empty factory file.

    models: the folder of the models' files. Raises InputError where the model is not there.
    """
    if name in SCENES:
        return SCENES[name](empty_scene())
    model = _loaded(name if name in MODELS else FROM_MODELS[name], models)
    if name in FROM_MODELS:
        return decimated.build(scene_in(bpy.context), name, model)
    return Sample(name, f"{MODELS[name]}, alone.", (model.name,))


def _loaded(name: str, models: Path) -> bpy.types.Object:
    """A model, shaded as its file says; smooth, if it is a scan whose file says nothing."""
    load(models / MODELS[name])
    model = next(thing for thing in bpy.data.objects if thing.type == "MESH")
    if name in SMOOTH:
        mesh_of(model).shade_smooth()
    return model


def stand_on_ground(scene: bpy.types.Scene, model: bpy.types.Object) -> None:
    """Put a ground plane under the model and a camera before it."""
    scene.view_layers[0].update()
    corners = np.array([model.matrix_world @ Vector(corner) for corner in model.bound_box])
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * 0.5 * _GROUND * size
    square += (middle[0], middle[1], low[2] - _GAP * (high[2] - low[2]))
    ground = bpy.data.meshes.new("Ground")
    ground.from_pydata(square.tolist(), [], [(0, 1, 2, 3)])
    stage.add(scene, "Ground", ground)
    camera = stage.add(scene, "Camera", bpy.data.cameras.new("Camera"))
    camera.location = middle + size * np.array([0.6, -1.5, 0.7])
    camera.rotation_euler = (Vector(middle) - camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.camera = camera
    scene.view_layers[0].update()


def empty_scene() -> bpy.types.Scene:
    """Of Blender's empty factory file, which replaces whatever is open."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return scene_in(bpy.context)


def names(models: Path) -> list[str]:
    """All scenes, those of models among them that the folder holds."""
    files = {**MODELS, **{name: MODELS[model] for name, model in FROM_MODELS.items()}}
    return [*SCENES, *(name for name, file in files.items() if (models / file).is_file())]


def of_one_surface(models: Path) -> list[str]:
    """Those of all scenes of which one object's own surface is baked."""
    return [name for name in names(models) if name not in (*HIGH_TO_LOW, *MANY)]


def sculpt(scene: bpy.types.Scene) -> Sample:
    """A sculpted stone of 2 million triangles, bumps upon bumps."""
    add_net(scene, "Sculpt", sculpted(SCULPT_SIDE))
    return Sample("sculpt", "A sculpt of 2 million triangles.", ("Sculpt",))


def sculpted(side: int) -> Doubles:
    """(side, side, 3) points on a bumpy ball, open by a degree at its poles; rows from the south, columns eastward."""
    turn = np.linspace(0.0, 2.0 * np.pi, side)
    turn[-1] = 0.0  # the seam's two columns are the same points, to the bit
    east, height = np.meshgrid(turn, np.linspace(radians(-89.0), radians(89.0), side))
    ball = np.stack([np.cos(east) * np.cos(height), np.sin(east) * np.cos(height), np.sin(height)], axis=-1)
    bumps = np.zeros((side, side))
    for waves, tall, seed in _OCTAVES:
        axes = np.random.default_rng(seed).normal(size=(3, 3))
        bumps += tall * np.prod([np.sin(waves * (ball @ axis) + place) for place, axis in enumerate(axes)], axis=0)
    return np.asarray(ball * (1.0 + bumps)[..., None])


def add_net(scene: bpy.types.Scene, name: str, points: Doubles) -> bpy.types.Object:
    """Smooth quads over a (rows, columns, 3) net, UVs along it; made of arrays, for nets of millions."""
    rows, columns = points.shape[:2]
    corner = (np.arange(rows - 1, dtype=np.int64)[:, None] * columns + np.arange(columns - 1, dtype=np.int64)).ravel()
    quads = np.stack([corner, corner + 1, corner + columns + 1, corner + columns], axis=1)
    along = [shapes.INSET + (1.0 - 2.0 * shapes.INSET) * np.linspace(0.0, 1.0, count) for count in (columns, rows)]
    uv = np.stack(np.meshgrid(*along), axis=-1).reshape(-1, 2)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(rows * columns)
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.ravel().astype(np.int32))
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    shapes.set_uv(mesh, uv[quads.ravel()])
    mesh.shade_smooth()
    return stage.add(scene, name, mesh)


def add_sheet(scene: bpy.types.Scene, name: str, side: int, size: float) -> bpy.types.Object:
    """A wavy sheet of 2 (side - 1)² triangles with UVs."""
    x, y = np.meshgrid(*[np.linspace(0.0, 1.0, side)] * 2)
    points = np.stack([size * x, size * y, 0.02 * size * np.sin(40.0 * x) * np.cos(30.0 * y)], axis=-1)
    return add_net(scene, name, points)


def add_sheets_on_vertices(scene: bpy.types.Scene) -> bpy.types.Object:
    """A carrier of 10,000 vertices, on each of which a mesh of 10,000 triangles stands; the ground beneath."""
    ground = add_sheet(scene, "Ground", 2, 100.0)
    carrier = add_sheet(scene, "Carrier", 100, 100.0)
    carrier.instance_type, carrier.show_instancer_for_render = "VERTS", False
    add_sheet(scene, "Child", 72, 0.6).parent = carrier
    carrier.location.z = 1.0
    return ground


def add_ball_on_plane(scene: bpy.types.Scene) -> bpy.types.Object:
    """A UV sphere of about a thousand triangles that rests on a plane."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=17, location=(0.0, 0.0, 1.0))
    (ball,) = scene.objects
    bpy.ops.mesh.primitive_plane_add(size=8.0)
    return ball


def interior(scene: bpy.types.Scene) -> Sample:
    """A closed room with one small window and furniture, walls and furniture in one texture."""
    mesh = bpy.data.meshes.new("Room")
    with shapes.solid(mesh) as draft:
        _room(draft, (5.0, 4.0, 2.6))
        for low, high in _furniture():
            shapes.box(draft, low, high)
    stage.unwrap(scene, stage.add(scene, "Room", mesh))
    return Sample("interior", "A closed room with a small window, seen from inside.", ("Room",))


def _room(draft: BMesh, size: stage.Triple) -> None:
    """Walls, floor and ceiling that face in, and a window with reveals in the wall at y = 0."""
    x, y, z = size
    left, right, sill, lintel, deep = 1.6, 3.4, 0.8, 2.2, 0.25
    walls: list[list[stage.Triple]] = [
        [(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0)],
        [(0, 0, z), (0, y, z), (x, y, z), (x, 0, z)],
        [(0, 0, 0), (0, y, 0), (0, y, z), (0, 0, z)],
        [(x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0)],
        [(0, y, 0), (x, y, 0), (x, y, z), (0, y, z)],
        [(0, 0, 0), (0, 0, z), (left, 0, z), (left, 0, 0)],
        [(right, 0, 0), (right, 0, z), (x, 0, z), (x, 0, 0)],
        [(left, 0, 0), (left, 0, sill), (right, 0, sill), (right, 0, 0)],
        [(left, 0, lintel), (left, 0, z), (right, 0, z), (right, 0, lintel)],
    ]
    frame = [(left, sill), (right, sill), (right, lintel), (left, lintel)]
    for (x0, z0), (x1, z1) in zip(frame, frame[1:] + frame[:1], strict=True):
        walls.append([(x0, 0, z0), (x1, 0, z1), (x1, -deep, z1), (x0, -deep, z0)])
    middles = [Vector((x / 2, y / 2, z / 2))] * 9 + [Vector(((left + right) / 2, 0.0, (sill + lintel) / 2))] * 4
    for corners, middle in zip(walls, middles, strict=True):
        face = draft.faces.new([draft.verts.new(corner) for corner in corners])
        face.normal_update()
        if face.normal.dot(middle - face.calc_center_median()) < 0.0:
            face.normal_flip()


def _furniture() -> list[tuple[stage.Triple, stage.Triple]]:
    """A table with four legs, a bed, a cupboard near the wall and boxes on the floor, as corners."""
    ground = CLEAR
    table = [((1.6, 1.2, 0.72), (3.2, 2.2, 0.76))]
    legs = [((x, y, ground), (x + 0.06, y + 0.06, 0.72 - CLEAR)) for x in (1.65, 3.09) for y in (1.25, 2.09)]
    bed = [((3.4, 2.6, 0.25), (4.95, 3.95, 0.5)), ((3.5, 2.7, ground), (4.8, 3.8, 0.25 - CLEAR))]
    cupboard = [((0.02, 2.4, ground), (0.6, 3.6, 2.1))]
    floor = [((0.9 + 0.3 * i, 3.3, ground), (1.1 + 0.3 * i, 3.5 + 0.1 * i, 0.15 + 0.15 * i)) for i in range(4)]
    return table + legs + bed + cupboard + floor


def instances(scene: bpy.types.Scene) -> Sample:
    """10,000 stones, instances of one mesh, on the ground that is baked."""
    stage.add(scene, "Ground", shapes.plane("Ground", 100.0, 100.0))
    rng = np.random.default_rng(11)
    grid = np.stack(np.meshgrid(*[np.linspace(-48.0, 48.0, STONES)] * 2), axis=-1).reshape(-1, 2)
    places = np.concatenate([grid + rng.uniform(-0.3, 0.3, grid.shape), rng.uniform(0.15, 0.5, (len(grid), 1))], axis=1)
    mesh = bpy.data.meshes.new("Places")
    mesh.from_pydata(places.tolist(), [], [])
    carrier = stage.add(scene, "Places", mesh)
    carrier.instance_type, carrier.show_instancer_for_render = "VERTS", False
    stone = stage.add(scene, "Stone", shapes.pebble("Stone", 5), scale=(0.5, 0.4, 0.35))
    stone.parent = carrier
    return Sample("instances", "10,000 stones, instances of one mesh, on a ground.", ("Ground",))


def gaps(scene: bpy.types.Scene) -> Sample:
    """Panels on a plate, slots of 1 to 64 mm between them; every edge hard."""
    corners: list[tuple[stage.Triple, stage.Triple]] = [((0.0, 0.0, -0.02), (0.6, 0.4, 0.0))]
    x = 0.03
    for gap in (*GAPS, 0.0):
        corners.append(((x, 0.03, CLEAR), (x + 0.045, 0.37, 0.08)))
        x += 0.045 + gap
    stage.unwrap(scene, stage.add(scene, "Panels", shapes.boxes("Panels", *corners)))
    return Sample("gaps", "Panels with slots of 1 to 64 mm between them.", ("Panels",))


def part(scene: bpy.types.Scene) -> Sample:
    """A flange with a hub, bores and ribs: bevelled, shaded smooth, its sharp edges marked."""
    mesh = bpy.data.meshes.new("Flange")
    bolts = [
        _circle(0.075, 24, (0.74 * np.cos(turn), 0.74 * np.sin(turn)))
        for turn in np.arange(8, dtype=np.int64) * np.pi / 4
    ]
    with shapes.solid(mesh) as draft:
        shapes.prism(draft, _circle(1.0, 96), (0.0, 0.0, 0.18), Matrix(), holes=[_circle(0.3, 64), *bolts])
        hub = Matrix.Translation((0.0, 0.0, 0.18 + CLEAR))
        shapes.prism(draft, _circle(0.46, 96), (0.0, 0.0, 0.55), hub, holes=[_circle(0.3, 64)])
        for turn in np.arange(4, dtype=np.int64) * np.pi / 2 + np.pi / 8:
            upright = Matrix.Rotation(turn, 4, "Z") @ Matrix.Translation((0.0, 0.03, 0.0)) @ _UPRIGHT
            low = 0.18 + CLEAR
            shapes.prism(draft, [(0.47, low), (0.92, low), (0.47, 0.6)], (0.0, -0.06, 0.0), upright)
    flange = stage.add(scene, "Flange", mesh)
    stage.unwrap(scene, flange)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.set_sharp_from_angle(angle=radians(30.0))
    stage.bevel(flange, 0.008)
    bevel: Any = flange.modifiers[-1]
    bevel.harden_normals = True
    return Sample("part", "A flange with hub, bores and ribs, smooth normals.", ("Flange",))


def _circle(radius: float, corners: int, at: tuple[float, float] = (0.0, 0.0)) -> list[tuple[float, float]]:
    turns = np.arange(corners, dtype=np.int64) * 2.0 * np.pi / corners
    return [(at[0] + radius * float(np.cos(turn)), at[1] + radius * float(np.sin(turn))) for turn in turns]


_UPRIGHT = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))  # x to x, y up

SCENES: dict[str, Build] = {
    **SAMPLES,
    "sculpt": sculpt,
    "interior": interior,
    "instances": instances,
    "gaps": gaps,
    "part": part,
    "character": character.build,
    "bevel_low": housing.build,
    "props": props.build,
}
MODELS = {"bunny": "stanford-bunny.obj", "rocker": "rocker-arm.obj", "spot": "spot.obj", "igea": "igea.ply"}
SMOOTH = ("igea",)
FROM_MODELS = {"igea_low": "igea"}
EVERY = (*SCENES, *MODELS, *FROM_MODELS)
HIGH_TO_LOW = ("igea_low", "bevel_low")
MANY = {"props": 8}  # of whose targets every so many-th is baked; of others the first is
OWN_SIZES = {"igea_low": decimated.SIZE, "props": props.SIZE}  # texels a side, whatever others are baked at
