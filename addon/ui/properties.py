"""The properties that an artist sets, kept in the scene."""

from __future__ import annotations

import math
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ...core.bake import LEAST_SPREAD, Settings
from ...core.base.errors import InputError
from ...core.finish.bent_normals import Bent, Space
from ...core.finish.map_finisher import LIGHT, RATIO
from ...core.quality import DEFAULT, PRESETS
from ...core.rays.map_spec import AO, Falloff, light, reflection
from ...core.solve.directional import Coding
from ...core.spherical.directional_format import Code

_RAYS = "RAYS"  # beside the presets
_QUALITIES = [
    ("DRAFT", "Draft", "Error 1/50, five steps of an 8-bit image: for a first look"),
    ("GOOD", "Good", "Error 1/255, one step of an 8-bit image: too little to see"),
    ("FINAL", "Final", "Error 1/510, half a step of an 8-bit image: what such an image rounds away"),
    (_RAYS, "Rays", "The same number of rays for every texel, nothing filtered, and whatever error comes of it"),
]
_DIRECTIONS = [
    ("NORMAL", "Normal", "The lobe stands on the surface: one texture for every view, as engines use it"),
    ("CAMERA", "Camera", "The lobe points where the scene's camera is mirrored: right for that view alone"),
]
_OCCLUDERS = [
    ("SCENE", "Scene", "Everything that shows in a render"),
    ("SELECTED", "Selected", "The selected objects alone, those baked among them"),
    ("SELF", "Only Itself", "Each object is hidden by its own faces alone"),
    ("COLLECTION", "Collection", "The objects of a collection, and each baked object itself"),
]
_OUTPUTS = [
    ("PACKED", "In the File", "Float images, packed into the .blend file and saved with it"),
    ("SAVED", "Saved", "Image files, by a path made of the object's and the map's name"),
    ("COLOURS", "Color Attribute", "Colors at the corners of the faces, no texture: UV map and size do not matter"),
    ("CHANNEL", "A Channel", "One channel of an image that is there, as R of a packed ORM; the others stay"),
]
_FORMATS = [
    ("PNG", "PNG", "8 or 16 bits a channel"),
    ("EXR", "OpenEXR", "16 or 32 bits a channel, with coverage as alpha"),
    ("TIFF", "TIFF", "8, 16 or 32 bits a channel"),
]
_DEPTHS = [("8", "8", "Bits a channel"), ("16", "16", "Bits a channel"), ("32", "32", "Bits a channel, float")]
_CHANNELS = [("R", "R", "Red: AO in ORM, and in glTF"), ("G", "G", "Green"), ("B", "B", "Blue"), ("A", "A", "Alpha")]
_UV = [
    ("ACTIVE", "Active Map", "The mesh's active UV map; charts are made where it has none"),
    ("CHARTS", "New Charts", "Charts in a UV map of their own; the mesh's other maps stay as they are"),
    ("SMART", "Smart UV Project", "Blender's own unwrap, in a UV map of its own; the other maps stay as they are"),
]


_SPACES = [
    ("TANGENT", "Tangent", "By the surface and its UV map, as tangent-space normal maps (MikkTSpace)"),
    ("OBJECT", "Object", "By the object's axes"),
    ("WORLD", "World", "By the scene's axes"),
]
_GREENS = [
    ("UP", "Y Up", "As OpenGL, Blender, glTF, Godot and Unity have it"),
    ("DOWN", "Y Down", "As DirectX and Unreal have it"),
]
_CODES = [
    ("SH", "Harmonics", "Spherical harmonics: pictures that can be filtered and kept in mip maps"),
    ("MASK8", "Mask 8 x 8", "A bit a cell, 8 bytes a texel; not to be filtered"),
    ("MASK16", "Mask 16 x 16", "A bit a cell, 32 bytes a texel: for sharper reflections; not to be filtered"),
]
_CODE_RAYS = [(str(count), str(count), "Rays a texel") for count in (256, 1024, 4096)]
_LIGHTS = [
    ("RATIO", "Share", "The share of the World's light that gets through, of each color: a colored AO"),
    ("LIGHT", "Light", "The light itself; it may be above 1"),
    ("BOTH", "Both", "Two pictures"),
]
_FALLOFFS = [
    ("NONE", "None", "All occluders within the distance block all of their light"),
    ("LINEAR", "Linear", "From all at the surface to none at the distance, evenly"),
    ("SMOOTH", "Smooth", "The same with a smooth start and end"),
]
_LAYOUTS = [
    ("EACH", "Each Object", "Every object has images of its own"),
    ("ATLAS", "All Objects", "The objects share their images: by their UV maps where all have one, else by charts "
     "that leave room for one another"),
]  # fmt: skip
_SOURCES = [
    ("SELF", "Own Surface", "Each object is baked as it is"),
    ("SELECTED", "Selected to Active", "The active object is baked from the other selected ones"),
    (
        "NAMES",
        "Names",
        "Objects named …_low are baked from those named …_high; a …_cage says where these are looked for",
    ),
]


class OcclusionBakeSettings(bpy.types.PropertyGroup):
    """Settings of the bake."""

    use_ao: BoolProperty(name="Ambient Occlusion", description="How open points are to diffuse light", default=True)
    use_ro: BoolProperty(
        name="Reflection Occlusion", description="Bake how open each point is to light it would reflect", default=False
    )
    exponents: StringProperty(
        name="Exponents",
        description="Phong exponents of the reflection's lobe, one texture each; e.g. 10 100",
        default="10",
    )
    direction: EnumProperty(
        name="Direction", description="What the reflected direction is taken from", items=_DIRECTIONS
    )
    divide_horizon: BoolProperty(
        name="Divide by Horizon",
        description="Divide by what an open surface would get, so that open points are white in grazing views, too",
        default=False,
    )
    use_bent: BoolProperty(
        name="Bent Normals", description="Bake the mean direction in which each point is open, as a normal map",
        default=False,
    )  # fmt: skip
    bent_space: EnumProperty(name="Space", description="What the directions are told by", items=_SPACES)
    bent_y: EnumProperty(name="Green", description="Which way green points, as in normal maps", items=_GREENS)
    bent_alpha: BoolProperty(name="AO in Alpha", description="Keep AO in the fourth channel", default=False)
    use_code: BoolProperty(
        name="Directional Code",
        description="Bake what reflection occlusion is rebuilt from in any view and for any exponent",
        default=False,
    )
    code: EnumProperty(name="Code", description="What is kept of a texel's visibility", items=_CODES)
    code_degree: IntProperty(
        name="Degree", description="Of the spherical harmonics: degree 3 is 16 numbers, four pictures", default=3,
        min=1, max=6,
    )  # fmt: skip
    code_rays: EnumProperty(name="Rays", description="Rays a texel that the code is made of", items=_CODE_RAYS)
    use_light: BoolProperty(
        name="World Light",
        description="Bake the light of the scene's World that gets to the surface, or the share of it that does",
        default=False,
    )
    light_picture: EnumProperty(name="Picture", description="What is baked of the light", items=_LIGHTS)
    use_light_lobe: BoolProperty(
        name="By Reflection's Lobes",
        description="Weight the light by the lobes of the exponents under Reflection, too",
        default=False,
    )
    width: IntProperty(name="Width", description="Texels across", default=1024, min=1, max=65536, subtype="PIXEL")
    height: IntProperty(name="Height", description="Texels down", default=1024, min=1, max=65536, subtype="PIXEL")
    quality: EnumProperty(
        name="Quality",
        description="How large the error may be (RMSE); each texel gets as many rays as that takes",
        items=_QUALITIES,
        default=DEFAULT.upper(),
    )
    rays: IntProperty(
        name="Rays", description="Rays a texel and map; four times as many give about a third of the error", default=64,
        min=1, soft_max=4096, max=1 << 20,
    )  # fmt: skip
    use_filter: BoolProperty(
        name="Filter",
        description="Smooth noise over the surface and leave shadows sharp; off: more rays instead, which take longer",
        default=True,
    )
    use_distance: BoolProperty(name="Limit Distance", description="Occluders farther away than this do not count")
    distance: FloatProperty(
        name="Distance", description="How far an occluder may be", default=1.0, min=1e-6, subtype="DISTANCE"
    )
    falloff: EnumProperty(name="Falloff", description="How occluders block less towards the distance", items=_FALLOFFS)
    nearest: FloatProperty(
        name="Minimum Distance", description="Occluders nearer than this do not count", default=0.0, min=0.0,
        soft_max=1.0, subtype="DISTANCE",
    )  # fmt: skip
    spread: FloatProperty(
        name="Spread", description="The cone that rays stay in; 180 degrees is all of the hemisphere",
        default=math.pi, min=math.radians(LEAST_SPREAD), max=math.pi, subtype="ANGLE",
    )  # fmt: skip
    use_front_only: BoolProperty(
        name="Front Faces Only", description="Faces block no light that comes from behind them", default=False
    )
    use_normal_maps: BoolProperty(
        name="Normal Maps",
        description="Turn the normals as the normal maps of the objects' materials do; Cycles' bake does always",
        default=False,
    )
    occluders: EnumProperty(name="Occluders", description="What may block light", items=_OCCLUDERS)
    collection: PointerProperty(
        name="Collection", description="Its objects, and those of the collections in it, block light",
        type=bpy.types.Collection,
    )  # fmt: skip
    use_ground: BoolProperty(
        name="Ground", description="Bake as if the objects stood on a level ground without end", default=False
    )
    source: EnumProperty(name="From", description="What surface is baked", items=_SOURCES)
    extrusion: FloatProperty(
        name="Extrusion",
        description="How far above and below the surface the high meshes are looked for; 0 is a fiftieth of its size",
        default=0.0, min=0.0, soft_max=1.0, subtype="DISTANCE",
    )  # fmt: skip
    cage: PointerProperty(
        name="Cage", description="A copy of the baked mesh, blown up: from it the high meshes are looked for",
        type=bpy.types.Object, poll=lambda self, obj: obj.type == "MESH",
    )  # fmt: skip
    layout: EnumProperty(name="Images Of", description="Whether objects share their images", items=_LAYOUTS)
    atlas: StringProperty(name="Name", description="What the shared images are called", default="Atlas")
    use_udim: BoolProperty(
        name="UDIM Tiles", description="Bake every tile of a UDIM layout, into tiled images; off: the first alone",
        default=True,
    )  # fmt: skip
    margin: IntProperty(
        name="Margin", description="Texels by which chart borders are carried outward", default=16, min=0,
        max=256, subtype="PIXEL",
    )  # fmt: skip
    uv: EnumProperty(name="UV Map", description="Which UV map to bake onto", items=_UV)
    seed: IntProperty(name="Seed", description="Same seed, same texture", default=0, min=0)
    threads: IntProperty(name="Threads", description="Processor threads; 0 is all", default=0, min=0, max=1024)
    output: EnumProperty(name="Output", description="Where the baked maps go", items=_OUTPUTS)
    path: StringProperty(
        name="Path",
        description="Of the image files: {object}, {map}, {width}, {height} and {file} stand for names and sizes, // "
        "for the folder of the .blend file",
        default="//textures/{object}_{map}",  # no FILE_PATH: Blender 5 shows a template of ours as a wrong path
    )
    format: EnumProperty(name="Format", description="Of the image files", items=_FORMATS)
    depth: EnumProperty(name="Depth", description="Bits a channel", items=_DEPTHS, default="16")
    use_dither: BoolProperty(
        name="Dither", description="Round integers by chance, so that slow gradients show no bands", default=True
    )
    image: PointerProperty(name="Image", description="Whose channel the map goes into", type=bpy.types.Image)
    channel: EnumProperty(name="Channel", description="The channel that the map goes into", items=_CHANNELS)
    use_material: BoolProperty(
        name="Show in Material",
        description="Multiply AO into the base color, and RO into the specular level, of the object's materials",
    )
    use_gltf: BoolProperty(
        name="glTF Occlusion", description="Put AO where Blender's glTF exporter looks for an occlusion texture"
    )
    cycles_samples: IntProperty(
        name="Cycles Samples",
        description="Samples that Cycles takes for the comparison",
        default=64,
        min=1,
        max=1 << 20,
    )


_POINTERS = frozenset({"collection", "image", "cage"})


def _show_or_hide(_: Any, context: bpy.types.Context) -> None:
    redraw(context, "VIEW_3D", every_region=True)


class OcclusionBakeResult(bpy.types.PropertyGroup):
    """What the last bake or comparison came to, for the panel."""

    lines: StringProperty(options={"SKIP_SAVE"})  # parted by line breaks
    show: BoolProperty(
        name="Show in Viewport",
        description="Show the baked textures on their objects in the 3D view, in Object Mode; no material is touched",
        default=True,
        update=_show_or_hide,
    )
    overlapping: BoolProperty(options={"SKIP_SAVE"})  # whether UVs overlap of what was baked
    asked: BoolProperty(options={"SKIP_SAVE"})  # whether the next press lets Blender unwrap


def show_lines(context: bpy.types.Context, lines: list[str]) -> None:
    """Put lines into the panel, in the place of earlier ones."""
    context.window_manager.occlusion_bake.lines = "\n".join(lines)
    if not lines:
        context.window_manager.occlusion_bake.overlapping = False


def add_lines(context: bpy.types.Context, lines: list[str]) -> None:
    """Add lines to the panel's."""
    shown = context.window_manager.occlusion_bake.lines
    show_lines(context, [*filter(None, shown.split("\n")), *lines])


def redraw(context: bpy.types.Context, *area_types: str, every_region: bool = False) -> None:
    """Let areas show what is new; of 3D views the sidebars alone, for their scene can take long to draw."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type in area_types else ():
                if every_region or area.type != "VIEW_3D" or region.type == "UI":
                    region.tag_redraw()


def by_rays(chosen: OcclusionBakeSettings) -> bool:
    """Whether the artist gives a number of rays, the plain estimate, in place of a quality."""
    return bool(chosen.quality == _RAYS)


def plain_settings(chosen: Any) -> dict[str, Any]:
    """All but the pointers, as plain values: to be kept, and to be baked by again."""
    return {name: getattr(chosen, name) for name in plain_names()}


def plain_names() -> list[str]:
    """Of the settings that are no pointers."""
    return [name for name in OcclusionBakeSettings.__annotations__ if name not in _POINTERS]


def core_settings(chosen: Any) -> Settings:
    """The panel's settings, or kept ones, as the core takes them. Raises InputError."""
    estimators = [AO] if chosen.use_ao else []
    if chosen.use_ro:
        camera = chosen.direction == "CAMERA"
        estimators += [reflection(each, from_camera=camera) for each in _exponents(chosen.exponents)]
    if chosen.use_light:
        estimators.append(light())
        if chosen.use_light_lobe:
            camera = chosen.direction == "CAMERA"
            estimators += [light(each, from_camera=camera) for each in _exponents(chosen.exponents)]
    return Settings(
        estimators=tuple(estimators),
        width=chosen.width,
        height=chosen.height,
        rays=chosen.rays,
        error=None if by_rays(chosen) else PRESETS[chosen.quality.lower()],
        filtered=chosen.use_filter and not by_rays(chosen),
        distance=chosen.distance if chosen.use_distance else None,
        margin=chosen.margin,
        threads=chosen.threads,
        seed=chosen.seed,
        divide_horizon=chosen.divide_horizon,
        nearest=chosen.nearest,
        falloff=Falloff[chosen.falloff] if chosen.use_distance else Falloff.NONE,
        spread=min(max(math.degrees(chosen.spread), LEAST_SPREAD), 180.0),  # the property is a float32
        front_only=chosen.use_front_only,
        normal_maps=chosen.use_normal_maps,
        bent=_bent(chosen),
        coding=_coding(chosen),
        lights=frozenset({RATIO, LIGHT} if chosen.light_picture == "BOTH" else {chosen.light_picture.lower()}),
    )


def _bent(chosen: Any) -> Bent | None:
    if not chosen.use_bent:
        return None
    return Bent(Space[chosen.bent_space], chosen.bent_y == "DOWN", chosen.bent_alpha)


def _coding(chosen: Any) -> Coding | None:
    if not chosen.use_code:
        return None
    code = (
        Code("sh", chosen.code_degree) if chosen.code == "SH" else Code("mask", int(chosen.code.removeprefix("MASK")))
    )
    return Coding(code, int(chosen.code_rays))


def _exponents(text: str) -> list[float]:
    try:
        exponents = list(dict.fromkeys(float(word) for word in text.replace(",", " ").split()))
    except ValueError:
        exponents = []
    if not exponents:
        raise InputError(f"Exponents {text!r}: give one or more numbers, as in 10 100")
    return exponents


CLASSES = (OcclusionBakeSettings, OcclusionBakeResult)


def add_properties() -> None:
    """Hang the settings on scenes, the result on the window manager: it lives as long as Blender runs."""
    bpy.types.Scene.occlusion_bake = PointerProperty(type=OcclusionBakeSettings)
    bpy.types.WindowManager.occlusion_bake = PointerProperty(type=OcclusionBakeResult)


def remove_properties() -> None:
    """And take them away."""
    del bpy.types.Scene.occlusion_bake
    del bpy.types.WindowManager.occlusion_bake
