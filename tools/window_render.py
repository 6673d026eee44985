"""Runs inside a Blender with a window, for try_window.py: `-- ZIP FOLDER NAME`.

What is baked into a material is in EEVEE what it is in Cycles. In a session of its own: where EEVEE is drawn in
software, its shaders alone take a minute.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from window_hand import Waits, act, check, install
from window_pace import ended, started

context: Any = bpy.context  # with the extension installed there is more than the stubs of Blender know


def session(archive: str, folder: Path, name: str) -> Waits:
    install(archive)
    bpy.data.objects["Cube"].location.z = 1.5
    bpy.ops.mesh.primitive_plane_add(size=12.0)
    yield from rebuilt(context.object, folder)
    print(f"Blender {bpy.app.version_string}: EEVEE and Cycles agree", flush=True)


def rebuilt(floor: Any, folder: Path) -> Waits:
    """RO from a code is in EEVEE what it is in Cycles, about normals too that turn within pixels, where a table that
    is filtered tells."""
    chosen = context.scene.occlusion_bake
    chosen.quality, chosen.rays = "RAYS", 1024
    chosen.width = chosen.height = 16  # texels larger than pixels, for their mip maps are right to differ
    chosen.use_ao, chosen.use_code, chosen.use_material = False, True, True
    yield from started()
    yield from ended("baking a code")
    tree = floor.active_material.node_tree
    group, end = (next(node for node in tree.nodes if node.type == kind) for kind in ("GROUP", "OUTPUT_MATERIAL"))
    light, normal = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    turned = ("MULTIPLY", (12, 12, 12)), ("SINE",), ("MULTIPLY_ADD", (0.4, 0.4, 0), (0, 0, 1)), ("NORMALIZE",)
    for operation, *operands in turned:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        for operand, socket in zip(operands, node.inputs[1:], strict=False):
            socket.default_value = operand
        tree.links.new(normal, node.inputs[0])
        normal = node.outputs["Vector"]
    tree.links.new(normal, group.inputs["Normal"])
    tree.links.new(group.outputs["RO"], light.inputs["Color"])
    tree.links.new(light.outputs[0], end.inputs["Surface"])
    bpy.data.objects["Cube"].hide_render = True
    eevee = rendered("BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT", folder / "eevee.exr")
    cycles = rendered("CYCLES", folder / "cycles.exr")
    seen = (eevee[:, 3] == 1.0) & (cycles[:, 3] == 1.0)
    apart = np.abs(eevee - cycles)[seen, 0]
    check(seen.sum() > 1000 and cycles[seen, 0].std() > 0.05, "the pictures of the code show nothing")
    check(apart.max() < 0.03, f"RO in EEVEE is up to {apart.max():.3f} off Cycles'")
    print(f"RO in EEVEE: within {apart.max():.4f} of Cycles, RMSE {np.sqrt((apart**2).mean()):.5f}", flush=True)


def rendered(engine: str, path: Path) -> Any:
    """(64², 4) values in the middles of pixels, not filtered."""
    scene, image = context.scene, context.scene.render.image_settings
    scene.render.engine, scene.render.filter_size, scene.eevee.taa_render_samples = engine, 0.0, 1
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.render.film_transparent, scene.view_settings.view_transform = True, "Raw"
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    made = bpy.data.images.load(str(path))
    values = np.array(made.pixels).reshape(-1, 4)
    bpy.data.images.remove(made)
    path.unlink()
    return values


if __name__ == "__main__":
    act(session)
