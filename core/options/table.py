"""The one table of options, in the order in which the command lists them.

To add one that the core already takes: a row here. `into` says where it stands in Settings; the command's argument, the
panel's property and its place, what images and reports tell, and what is kept and handed on follow.
"""

from __future__ import annotations

import argparse
from typing import Any

from ..base.errors import InputError
from ..charts.udim import Udim
from ..finish.image_file import FORMATS
from ..maps.bent_normals import Space
from ..maps.registry import MAPS
from ..rays.map_spec import SAMPLERS
from ..rays.ray_options import LEAST_SPREAD, WHOLE_SPREAD, Falloff
from ..settings import DEFAULT_QUALITY, MAX_SIZE, MAX_THREADS, QUALITIES
from ..solve.directional import FEWEST_RAYS
from ..solve.goal import MAX_RAYS
from . import parse
from .option import Choice, Chosen, Flag, Item, Option, Place, Pointer, Real, Switch, Text, Told, Whole

COMPARED_SAMPLES = 64
BY_RAYS = "rays"  # of the panel's qualities: a number of rays, the plain estimate

SCENE, SELECTED, SELF, COLLECTION = "scene", "selected", "self", "collection"  # the panel's occluders
NAMES = "names"  # and sources
PACKED, SAVED, COLOURS, CHANNEL = "packed", "saved", "colours", "channel"  # where maps go
EACH, ATLAS = "each", "atlas"


def by_rays(chosen: Chosen) -> bool:
    """Whether the artist gives a number of rays, the plain estimate, in place of a quality."""
    return bool(chosen.quality == BY_RAYS.upper())


def _is(name: str, *values: str) -> Any:
    """Whether a choice of the panel is one of these."""
    return lambda chosen: getattr(chosen, name).lower() in values


def _may_have_tiles(chosen: Chosen) -> bool:
    """A channel takes the first tile of an object, as it has no other; in an atlas charts of all tiles have room."""
    kept = (PACKED, SAVED, CHANNEL) if chosen.layout.lower() == ATLAS else (PACKED, SAVED)
    return bool(_is("output", *kept)(chosen))


def _exponents(chosen: Chosen) -> list[float]:
    text = chosen.exponents
    try:
        exponents = list(dict.fromkeys(float(word) for word in text.replace(",", " ").split()))
    except ValueError:
        exponents = []
    if not exponents:
        raise InputError(f"Exponents {text!r}: give one or more numbers, as in 10 100")
    return exponents


def _code(chosen: Chosen) -> str:
    return f"sh_{chosen.code_degree}" if chosen.code == "SH" else f"mask_{chosen.code.removeprefix('MASK')}"


def _wanted_error(chosen: Chosen) -> float | None:
    return None if by_rays(chosen) else QUALITIES[chosen.quality.lower()]


_QUALITY_ITEMS = (
    Item("draft", "Draft", "Error 1/50, five steps of an 8-bit image: for a first look"),
    Item("good", "Good", "Error 1/255, one step of an 8-bit image: too little to see"),
    Item("final", "Final", "Error 1/510, half a step of an 8-bit image: what such an image rounds away"),
    Item(BY_RAYS, "Rays", "The same number of rays for every texel, nothing filtered, and whatever error comes of it"),
)
_ERRORS = ", ".join(f"{name} 1/{1 / error:.0f}" for name, error in QUALITIES.items())

# May be given more than once: --objects=-A --objects=-B are objects whose names would be taken for options.
_NAMES = {"nargs": "+", "action": "extend", "metavar": "NAME", "default": None}

_MAPS = (
    Option(
        "maps",
        Text("ao"),
        Flag(
            "--maps",
            "what to bake; light-…: of the scene's World (ao)",
            {"nargs": "+", "choices": [entry.name for entry in MAPS if entry.listed], "default": ["ao"]},
        ),
    ),
    *(
        Option(entry.switch, Switch(entry.name == "ao"), place=Place(entry.label, entry.description))
        for entry in MAPS
        if entry.switch
    ),
    Option(
        "use_light",
        Switch(),
        place=Place(
            "World Light",
            "Bake the light of the scene's World that gets to the surface, or the share of it that does",
        ),
    ),
    Option(
        "light_picture",
        Choice(
            (
                Item(
                    "ratio",
                    "Share",
                    "The share of the World's light that gets through, of each color: a colored AO",
                ),
                Item("light", "Light", "The light itself; it may be above 1"),
                Item("both", "Both", "Two pictures"),
            )
        ),
        place=Place("Picture", "What is baked of the light", "light", 1),
    ),
    Option(
        "use_light_lobe",
        Switch(),
        place=Place(
            "By Reflection's Lobes",
            "Weight the light by the lobes of the exponents under Reflection, too",
            "light",
            2,
        ),
    ),
)

_EFFORT = (
    Option(
        "size",
        Text(),
        Flag(
            "--size",
            "texels of the image (1024)",
            {"type": parse.size, "default": (1024, 1024), "metavar": "N|WxH"},
        ),
        from_panel=lambda chosen: (chosen.width, chosen.height),
    ),
    Option("width", Whole(1024, 1, MAX_SIZE, unit="PIXEL"), place=Place("Width", "Texels across"), into="image.width"),
    Option("height", Whole(1024, 1, MAX_SIZE, unit="PIXEL"), place=Place("Height", "Texels down"), into="image.height"),
    Option(
        "quality",
        Choice(_QUALITY_ITEMS, DEFAULT_QUALITY),
        Flag(
            "--quality",
            f"the error by name: {_ERRORS} ({DEFAULT_QUALITY})",
            {"choices": list(QUALITIES), "default": None},
            group="effort",
        ),
        Place("Quality", "How large the error may be (RMSE); each texel gets as many rays as that takes"),
    ),
    Option(
        "error",
        Real(0.0),
        Flag(
            "--error",
            "bake to this RMSE, e.g. 0.004 or 1/255",
            {"type": parse.error, "metavar": "E", "default": None},
            group="effort",
        ),
        into="goal.error",
        from_panel=_wanted_error,
    ),
    Option(
        "rays",
        Whole(64, 1, MAX_RAYS, 4096),
        Flag(
            "--rays",
            "rays a texel and map, nothing filtered (64 for naive samplers)",
            {"metavar": "N", "default": None},
            group="effort",
        ),
        Place("Rays", "Rays a texel and map; four times as many give about a third of the error"),
        into="goal.rays",
    ),
    Option(
        "use_filter",
        Switch(True),
        Flag(
            "--filter",
            "smooth noise over the surface (where an error is asked for)",
            {"action": argparse.BooleanOptionalAction, "default": None},
        ),
        Place(
            "Filter",
            "Smooth noise over the surface and leave shadows sharp; off: more rays instead, which take longer",
            "options",
            6,
            active=lambda chosen: not by_rays(chosen),
        ),
        into="goal.filtered",
        from_panel=lambda chosen: chosen.use_filter and not by_rays(chosen),
    ),
)

_WHO = (
    Option("use_distance", Switch(), place=Place("Limit Distance", "Occluders farther away than this do not count")),
    Option(
        "distance",
        Real(1.0, 1e-6, unit="DISTANCE"),
        Flag(
            "--distance",
            "how far an occluder may be (no limit)",
            {"type": float, "metavar": "D", "default": None},
        ),
        Place("Distance", "How far an occluder may be"),
        into="rays.distance",
        told=Told("distance", 1, lambda distance: "none" if distance is None else distance),
        from_panel=lambda chosen: chosen.distance if chosen.use_distance else None,
    ),
    Option(
        "occluders",
        Choice(
            (
                Item(SCENE, "Scene", "Everything that shows in a render"),
                Item(SELECTED, "Selected", "The selected objects alone, those baked among them"),
                Item(SELF, "Only Itself", "Each object is hidden by its own faces alone"),
                Item(COLLECTION, "Collection", "The objects of a collection, and each baked object itself"),
            )
        ),
        Flag(
            "--occluders",
            "what blocks light: the scene, self (each object its own alone), or objects and collections (scene)",
            {**_NAMES, "metavar": "scene|self|NAME", "choices": None},
        ),
        Place("Occluders", "What may block light", "occluders", 1, text="Objects"),
    ),
    Option(
        "collection",
        Pointer("Collection"),
        place=Place(
            "Collection",
            "Its objects, and those of the collections in it, block light",
            "occluders",
            2,
            shown=_is("occluders", COLLECTION),
        ),
    ),
    Option(
        "use_ground",
        Switch(),
        Flag("--ground", "and a level ground below all that blocks light in the scene"),
        Place("Ground", "Bake as if the objects stood on a level ground without end", "occluders", 3),
    ),
    Option(
        "source",
        Choice(
            (
                Item(SELF, "Own Surface", "Each object is baked as it is"),
                Item(SELECTED, "Selected to Active", "The active object is baked from the other selected ones"),
                Item(
                    NAMES,
                    "Names",
                    "Objects named …_low are baked from those named …_high; a …_cage says where these are looked for",
                ),
            )
        ),
        place=Place("From", "What surface is baked", "highs", 1),
    ),
    Option(
        "highs",
        Text(),
        Flag(
            "--highs",
            "meshes to bake the one object of --objects from",
            _NAMES,
            group="sources",
        ),
    ),
    Option(
        "pairs",
        Switch(),
        Flag("--pairs", "bake each …_low from its …_high meshes, in its …_cage", group="sources"),
    ),
    Option(
        "cage",
        Pointer("Object"),
        Flag("--cage", "the object of --objects blown up, to look for --highs from", {"metavar": "NAME"}),
        Place(
            "Cage",
            "A copy of the baked mesh, blown up: from it the high meshes are looked for",
            "highs",
            2,
            shown=_is("source", SELECTED),
            active=lambda chosen: chosen.source != "SELF",
        ),
    ),
    Option(
        "extrusion",
        Real(0.0, soft_high=1.0, unit="DISTANCE"),
        Flag(
            "--extrusion",
            "how far above and below the surface high meshes are looked for (a fiftieth of its diagonal)",
            {"type": float, "metavar": "D", "default": None},
        ),
        Place(
            "Extrusion",
            "How far above and below the surface the high meshes are looked for; 0 is a fiftieth of its size",
            "highs",
            3,
            active=lambda chosen: chosen.source != "SELF",
        ),
    ),
)

_REACH = (
    Option(
        "falloff",
        Choice(
            (
                Item("none", "None", "All occluders within the distance block all of their light"),
                Item("linear", "Linear", "From all at the surface to none at the distance, evenly"),
                Item("smooth", "Smooth", "The same with a smooth start and end"),
            ),
            "none",
            Falloff,
        ),
        Flag("--falloff", "how occluders block less towards the distance (none)"),
        Place(
            "Falloff",
            "How occluders block less towards the distance",
            "options",
            2,
            active=lambda chosen: chosen.use_distance,
        ),
        into="rays.falloff",
        told=Told("falloff", 3),
        from_panel=lambda chosen: chosen.falloff.lower() if chosen.use_distance else "none",
    ),
    Option(
        "nearest",
        Real(0.0, soft_high=1.0, unit="DISTANCE"),
        Flag("--min-distance", "nearer occluders do not count (0)", {"metavar": "D"}),
        Place("Minimum Distance", "Occluders nearer than this do not count", "options", 3),
        into="rays.nearest",
        told=Told("minimum_distance", 2),
    ),
    Option(
        "spread",
        Real(WHOLE_SPREAD, LEAST_SPREAD, WHOLE_SPREAD, unit="ANGLE"),
        Flag("--spread", "the cone that rays stay in (180)", {"metavar": "DEGREES"}),
        Place("Spread", "The cone that rays stay in; 180 degrees is all of the hemisphere", "options", 4),
        into="rays.spread",
        told=Told("spread", 4),
    ),
    Option(
        "use_front_only",
        Switch(),
        Flag("--front-faces", "faces block no light that comes from behind them"),
        Place("Front Faces Only", "Faces block no light that comes from behind them", "occluders", 4),
        into="rays.front_only",
        told=Told("faces", 5, lambda front_only: "front" if front_only else "both"),
    ),
    Option(
        "use_normal_maps",
        Switch(),
        Flag("--normal-maps", "turn the normals as the normal maps of the objects' materials do"),
        Place(
            "Normal Maps",
            "Turn the normals as the normal maps of the objects' materials do; Cycles' bake does always",
            "options",
            5,
        ),
        into="normal_maps",
        told=Told("normal_maps", 6, lambda followed: "yes" if followed else "no"),
    ),
)

_DIRECTIONS = (
    Option(
        "bent_space",
        Choice(
            (
                Item(
                    Space.TANGENT.value,
                    "Tangent",
                    "By the surface and its UV map, as tangent-space normal maps (MikkTSpace)",
                ),
                Item(Space.OBJECT.value, "Object", "By the object's axes"),
                Item(Space.WORLD.value, "World", "By the scene's axes"),
            ),
            "tangent",
        ),
        Flag("--bent-space", "what bent normals are told by (tangent)"),
        Place("Space", "What the directions are told by", "bent", 1),
    ),
    Option(
        "bent_y",
        Choice(
            (
                Item("up", "Y Up", "As OpenGL, Blender, glTF, Godot and Unity have it"),
                Item("down", "Y Down", "As DirectX and Unreal have it"),
            ),
            "up",
        ),
        Flag("--bent-y", "which way their green points (up)"),
        Place("Green", "Which way green points, as in normal maps", "bent", 2, expand=True),
    ),
    Option(
        "bent_alpha",
        Switch(),
        Flag("--bent-alpha", "AO in their alpha"),
        Place("AO in Alpha", "Keep AO in the fourth channel", "bent", 3),
    ),
    Option(
        "code",
        Choice(
            (
                Item(
                    "sh",
                    "Harmonics",
                    "Spherical harmonics: pictures that can be filtered and kept in mip maps",
                ),
                Item("mask8", "Mask 8 x 8", "A bit a cell, 8 bytes a texel; not to be filtered"),
                Item(
                    "mask16",
                    "Mask 16 x 16",
                    "A bit a cell, 32 bytes a texel: for sharper reflections; not to be filtered",
                ),
            )
        ),
        Flag(
            "--code",
            "a directional code: sh_1 to sh_6, mask_8, mask_16, cells_8 or cells_16",
            {"metavar": "NAME", "choices": None},
        ),
        Place("Code", "What is kept of a texel's visibility", "code", 1),
        from_panel=_code,
    ),
    Option(
        "code_degree",
        Whole(3, 1, 6),
        place=Place(
            "Degree",
            "Of the spherical harmonics: degree 3 is 16 numbers, four pictures",
            "code",
            2,
            shown=_is("code", "sh"),
        ),
    ),
    Option(
        "code_rays",
        Choice(tuple(Item(str(count), str(count), "Rays a texel") for count in (256, 1024, 4096))),
        Flag(
            "--code-rays",
            f"rays a texel of the code ({FEWEST_RAYS})",
            {"type": int, "default": FEWEST_RAYS, "metavar": "N", "choices": None},
        ),
        Place("Rays", "Rays a texel that the code is made of", "code", 3),
        from_panel=lambda chosen: int(chosen.code_rays),
    ),
    Option(
        "exponents",
        Text("10"),
        Flag(
            "--ro-exponent",
            "Phong exponents of RO (10)",
            {"type": float, "nargs": "+", "default": [10.0], "metavar": "E"},
        ),
        Place(
            "Exponents",
            "Phong exponents of the reflection's lobe, one texture each; e.g. 10 100",
            "reflection",
            1,
        ),
        from_panel=_exponents,
    ),
    Option(
        "direction",
        Choice(
            (
                Item(
                    "normal",
                    "Normal",
                    "The lobe stands on the surface: one texture for every view, as engines use it",
                ),
                Item(
                    "camera",
                    "Camera",
                    "The lobe points where the scene's camera is mirrored: right for that view alone",
                ),
            ),
            "normal",
        ),
        Flag("--ro-direction", "what R is taken from (normal)"),
        Place("Direction", "What the reflected direction is taken from", "reflection", 2),
    ),
    Option(
        "divide_horizon",
        Switch(),
        Flag(
            "--ro-horizon",
            "the formula as it stands, or divided by its value in the open (keep)",
            {"choices": ("keep", "divide"), "default": "keep", "action": "store"},
        ),
        Place(
            "Divide by Horizon",
            "Divide by what an open surface would get, so that open points are white in grazing views, too",
            "reflection",
            3,
            active=lambda chosen: chosen.direction == "CAMERA",
        ),
    ),
    Option(
        "sampler",
        Choice(tuple(Item(name, name, "") for name in SAMPLERS), "importance"),
        Flag("--sampler", "naive ones are for comparison (importance)"),
        from_panel=lambda chosen: "importance",
    ),
)

_WHERE = (
    Option(
        "uv",
        Choice(
            (
                Item("active", "Active Map", "The mesh's active UV map; charts are made where it has none"),
                Item(
                    "charts",
                    "New Charts",
                    "Charts in a UV map of their own; the mesh's other maps stay as they are, as does one of ours that "
                    "was renamed or edited",
                ),
                Item(
                    "smart",
                    "Smart UV Project",
                    "Blender's own unwrap, in a UV map of its own; the other maps stay as they are",
                ),
            )
        ),
        Flag(
            "--uv",
            "the UV map; charts, smart: make one, of our charts or Smart UV Project's (the active, charts where there "
            "is none)",
            {"metavar": "NAME|charts|smart", "choices": None},
        ),
        Place("UV Map", "Which UV map to bake onto", "options", 7),
    ),
    Option(
        "layout",
        Choice(
            (
                Item(EACH, "Each Object", "Every object has images of its own"),
                Item(
                    ATLAS,
                    "All Objects",
                    "The objects share their images: by their UV maps where these leave room for one another, else by "
                    "the charts of these and new ones of the others, side by side in a UV map of their own",
                ),
            )
        ),
        place=Place("Images Of", "Whether objects share their images", "output", 1, text="Images Of"),
    ),
    Option(
        "atlas",
        Text("Atlas"),
        Flag(
            "--atlas",
            "one image of this name for all objects (one each)",
            {"nargs": "?", "const": "Atlas", "metavar": "NAME", "default": None},
        ),
        Place("Name", "What the shared images are called", "output", 2, shown=_is("layout", ATLAS)),
    ),
    Option(
        "udim",
        Choice(
            (
                Item(
                    Udim.AUTO.value, "Automatic", "By what they look like: copies lie upon one another or are mirrored"
                ),
                Item(Udim.LAYOUT.value, "Layout", "Tiles of a UDIM layout: every tile gets its image, in tiled images"),
                Item(
                    Udim.STACKED.value,
                    "Stacked",
                    "Copies, moved aside: the first tile alone is baked, into one image, by UV maps as they are",
                ),
            ),
            "auto",
        ),
        Flag("--udim", "what UVs beyond the unit square are: tiles with an image each, or copies moved aside (auto)"),
        Place(
            "UDIM",
            "What UVs beyond the unit square are",
            "output",
            10,
            shown=_may_have_tiles,
        ),
    ),
    Option(
        "coverage",
        Text(),
        Flag("--coverage", "write the texels' coverage, too", {"metavar": "FILE", "default": None}),
    ),
    Option(
        "output",
        Choice(
            (
                Item(PACKED, "In the File", "Float images, packed into the .blend file and saved with it"),
                Item(SAVED, "Saved", "Image files, by a path made of the object's and the map's name"),
                Item(
                    COLOURS,
                    "Color Attribute",
                    "Colors at the corners of the faces, no texture: UV map and size do not matter",
                ),
                Item(
                    CHANNEL,
                    "A Channel",
                    "One channel of an image that is there, as R of a packed ORM; the others stay. A file is written "
                    "at once, at its own depth",
                ),
            )
        ),
        place=Place("Output", "Where the baked maps go", "output", 3, text="To"),
    ),
    Option(
        "folder",
        Text(),
        Flag(
            "--output",
            "for the images; // is the scene's (occlusion_bake)",
            {"default": "occlusion_bake", "metavar": "FOLDER"},
        ),
    ),
    Option(
        "path",
        Text("//textures/{object}_{map}"),  # no file path's subtype: Blender 5 shows a template of ours as a wrong path
        place=Place(
            "Path",
            "Of the image files: {object}, {map}, {width}, {height} and {file} stand for names and sizes, // for the "
            "folder of the .blend file, ~ for your own",
            "output",
            4,
            shown=_is("output", SAVED),
        ),
    ),
    Option(
        "image",
        Pointer("Image"),
        place=Place("Image", "Whose channel the map goes into", "output", 7, shown=_is("output", CHANNEL)),
    ),
    Option(
        "channel",
        Choice(
            (
                Item("r", "R", "Red: AO in ORM, and in glTF"),
                Item("g", "G", "Green"),
                Item("b", "B", "Blue"),
                Item("a", "A", "Alpha, which is a channel of its own then (Channel Packed)"),
            )
        ),
        place=Place(
            "Channel",
            "The channel that the map goes into",
            "output",
            8,
            expand=True,
            shown=_is("output", CHANNEL),
        ),
    ),
    Option(
        "into",
        Text(),
        Flag(
            "--into",
            "write the one map into a channel of an image that is there, as orm.png:R, in place of files in a folder",
            {"type": parse.channel, "metavar": "FILE:R|G|B|A", "default": None},
        ),
    ),
    Option(
        "color_attributes",
        Text(),
        Flag(
            "--color-attributes",
            "bake color attributes, no textures, and write a copy of the scene with them",
            {"metavar": "FILE.blend", "default": None},
        ),
    ),
    Option(
        "format",
        Choice(tuple(Item(name, each.label, each.description) for name, each in FORMATS.items()), "png"),
        Flag("--format", "of the images (png)"),
        Place("Format", "Of the image files", "output", 5, shown=_is("output", SAVED)),
    ),
    Option(
        "depth",
        Choice(
            (
                Item("8", "8", "Bits a channel"),
                Item("16", "16", "Bits a channel"),
                Item("32", "32", "Bits a channel, float"),
            ),
            "16",
        ),
        Flag("--depth", "bits a channel (16)", {"type": int, "choices": (8, 16, 32), "default": 16}),
        Place("Depth", "Bits a channel", "output", 6, expand=True, shown=_is("output", SAVED)),
        from_panel=lambda chosen: int(chosen.depth),
    ),
    Option(
        "use_dither",
        Switch(True),
        Flag(
            "--dither",
            "round integers by chance, so that slow gradients show no bands",
            {"action": "store_true", "default": False},
        ),
        Place(
            "Dither",
            "Round integers by chance, so that slow gradients show no bands",
            "output",
            9,
            shown=_is("output", SAVED, CHANNEL),
            active=lambda chosen: chosen.output != "SAVED" or chosen.depth == "8",
        ),
    ),
    Option(
        "use_skip",
        Switch(),
        place=Place(
            "Skip Unchanged",
            "Leave objects as they are whose images were baked from the same: mesh, UVs, what blocks light within "
            "reach, and settings",
            "output",
            11,
            shown=_is("output", PACKED, SAVED),
        ),
    ),
    Option(
        "margin",
        Whole(16, 0, 256, unit="PIXEL"),
        Flag("--margin", "texels to carry chart borders outward (16)", {"metavar": "PX"}),
        Place("Margin", "Texels by which chart borders are carried outward", "options_end", 1),
        into="image.margin",
    ),
    Option(
        "threads",
        Whole(0, 0, MAX_THREADS),
        Flag("--threads", "processor threads (all)", {"metavar": "N"}),
        Place("Threads", "Processor threads; 0 is all", "options_end", 3),
        into="threads",
    ),
    Option(
        "seed",
        Whole(0),
        Flag("--seed", "same seed, same bits (0)", {"metavar": "S"}),
        Place("Seed", "Same seed, same texture", "options_end", 2),
        into="seed",
    ),
    Option(
        "use_material",
        Switch(),
        place=Place(
            "Show in Material",
            "Multiply AO into the base color, and RO into the specular level, of the object's materials. One that "
            "other objects use, too, or that is linked, is copied for the object, until Remove from Materials",
            "material",
            1,
        ),
    ),
    Option(
        "use_gltf",
        Switch(),
        place=Place(
            "glTF Occlusion",
            "Put AO where Blender's glTF exporter looks for an occlusion texture",
            "material",
            2,
        ),
    ),
    Option(
        "cycles_samples",
        Whole(COMPARED_SAMPLES, 1, 1 << 20),
        Flag(
            "--compare-cycles",
            f"bake AO with Cycles, too, and compare ({COMPARED_SAMPLES})",
            {"nargs": "?", "const": COMPARED_SAMPLES, "metavar": "SAMPLES", "default": None},
        ),
        Place("Cycles Samples", "Samples that Cycles takes for the comparison", "cycles", 1, text="Samples"),
    ),
    Option(
        "report",
        Text(),
        Flag(
            "--report",
            "write what was done, how fast and how well",
            {"metavar": "FILE.json", "default": None},
        ),
    ),
)

_OBJECTS = (
    Option(
        "objects",
        Text(),
        Flag("--objects", "what to bake (all meshes that render)", _NAMES),
    ),
)

OPTIONS = (*_OBJECTS, *_MAPS, *_EFFORT, *_WHO, *_REACH, *_DIRECTIONS, *_WHERE)
BY_NAME = {option.name: option for option in OPTIONS}
