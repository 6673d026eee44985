"""What the buttons do: bake, unwrap, compare with Cycles, cancel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import bpy

from ...core.base.errors import Cancelled, InputError, NoUnwrapper
from ...core.finish.baked import Baked
from ...core.finish.report import (
    error_in_words,
    first_of,
    million_rays_per_second,
    object_entry,
    rays_per_texel,
    times_as_long,
)
from ...core.maps.occlusion import AMBIENT
from ...core.progress import Progress
from ...core.rays.embree import Device
from ...core.scene.scene import Instance
from ..charts.chart_marks import OUR_NAMES
from ..charts.chart_request import CHARTS, SMART
from ..charts.rollback import chart_rollback
from ..compare.steps import compare_here, compare_in_child
from ..job.bake_job import BakeJob, Deliver, Unchanged, bake_steps, prepared_charts
from ..job.outcome import BAKING, Outcome
from ..job.runner import Steps
from ..output.blender_images import TileFiles, show_picture, tile_files
from ..output.color_attributes import store_colours
from ..output.destination import CHANNEL
from ..output.material_links import has_linked_images, link_images, unlink_images
from ..output.node_materials import lines_on_node_materials
from ..output.result import Result, Texture
from ..output.unchanged import KeptImages, store_inputs
from ..read.block_ref import BlockRef, find
from ..typed import Ended, library_of, mesh_of, view_layer_in
from . import viewport_overlay
from .image_editor import show_in_editor
from .modal_operator import LongOperator, running
from .properties import add_lines, redraw, result_in, settings_in, show_lines
from .request import (
    BakeRequest,
    check_occluders,
    chosen_objects,
    is_ours,
    request_from_image,
    request_from_panel,
    store_request,
)
from .select_overlap import select_overlap
from .translate import say

_NAMED = 6  # occluders in the line that says who they were


class _BakeOperator(LongOperator):
    """Mixed into an operator that bakes what its `request` says."""

    _previewed: Any = None  # the values that the 3D view shows

    def request(self, context: bpy.types.Context) -> BakeRequest:
        """What to bake, and where to. Raises InputError."""
        raise NotImplementedError

    def preview(self, context: bpy.types.Context, progress: Progress) -> bool:
        """On the object in the 3D view."""
        preview = progress.preview
        ref = next((ref for ref, state in self.states.items() if state == BAKING), None)
        if preview is None or ref is None or not result_in(context).show:
            return False
        obj, values = find(view_layer_in(context).objects, ref), preview.values()
        if obj is None or values is None or values is self._previewed:
            return False
        self._previewed = values
        viewport_overlay.show_making(obj.session_uid, preview.target, values)
        redraw(context, "VIEW_3D", every_region=True)
        return True

    def start(self, context: bpy.types.Context, progress: Progress) -> Steps:
        request, outcome = self.request(context), Outcome()
        atlas, settings = request.job.layout.atlas, request.job.settings
        request.destination.check([atlas] if atlas else [ref.label for ref in request.job.objects], settings)
        job = _second_press(context, request.job)
        show_lines(context, [])
        self.states = outcome.states
        with tile_files() as tiles, chart_rollback(context, outcome.charting.changes, outcome.finished):
            deliver = self._deliverer(context, request, outcome, tiles)
            try:
                unchanged = _unchanged(context, request)
                yield from bake_steps(context, job, progress, outcome, deliver, unchanged)
            except Cancelled:
                if not outcome.finished:
                    raise
            finally:
                _ask_for_second_press(context, outcome)
                viewport_overlay.end_making()
                redraw(context, "VIEW_3D", every_region=True)
        self._conclude(context, job, outcome)

    def _deliverer(
        self, context: bpy.types.Context, request: BakeRequest, outcome: Outcome, tiles: TileFiles
    ) -> Deliver:
        """Takes each result into its image; the artist may have renamed or removed the object in the meantime."""

        def deliver(result: Result) -> None:
            found, baked = _still_there(result, outcome), result.baked
            put(context, result, found, request, tiles)
            for _, obj, target in found:
                viewport_overlay.show(obj, target, baked, anew=result.is_first)
            result_in(context).overlapping |= baked.surface.overlapped > 0
            assert outcome.baker is not None  # by which it was baked
            add_lines(context, [*result_lines(baked, outcome.baker.device), *baked.warnings])
            for line in baked.warnings:
                self.report({"WARNING"}, line)

        return deliver

    def _conclude(self, context: bpy.types.Context, job: BakeJob, outcome: Outcome) -> None:
        add_lines(context, [_occluders_line(outcome.occluders), *outcome.notes, *outcome.refused])
        for line in outcome.notes:
            self.report({"INFO"}, line)
        for line in outcome.refused:
            self.report({"WARNING"}, line)
        left = len(outcome.left)
        baked, wanted = len(outcome.finished) - left, len(job.objects) - left
        if left:
            line = say("Not changed, and left as it is: {}", _counted(left))
            add_lines(context, [line])
            self.report({"INFO"}, line)
        what = say("Baked {}", _counted(baked)) if baked == wanted else say("Baked {} of {}", baked, _counted(wanted))
        took = say("{}, then was cancelled", what)
        if outcome.complete:
            took = say("{} in {:.2f} s", what, outcome.clock.shared["total"])
        self.report({"INFO"}, took)


class OCCLUSION_BAKE_OT_bake(_BakeOperator, bpy.types.Operator):
    """Bake the selected meshes into images named after them. UV charts are made where there is no UV map"""

    bl_idname = "occlusion_bake.bake"
    bl_label = "Bake Occlusion"
    bl_options = {"UNDO"}

    def request(self, context: bpy.types.Context) -> BakeRequest:
        check_occluders(context)
        return request_from_panel(context)


class OCCLUSION_BAKE_OT_again(_BakeOperator, bpy.types.Operator):
    """Bake the object of the shown image once more, by the settings that the image was baked with"""

    bl_idname = "occlusion_bake.again"
    bl_label = "Bake Again"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not cls.is_idle():
            return False
        if not is_ours(getattr(context, "edit_image", None)):
            cls.poll_message_set("Show an image that Occlusion Bake has made")
            return False
        return True

    def request(self, context: bpy.types.Context) -> BakeRequest:
        image: Any = context.edit_image
        return request_from_image(view_layer_in(context), image)


class OCCLUSION_BAKE_OT_unwrap(LongOperator, bpy.types.Operator):
    """Make UV charts in a map of their own for the meshes that Bake would bake; their other UV maps stay as they are"""

    bl_idname = "occlusion_bake.unwrap"
    bl_label = "Make UV Charts"
    bl_options = {"UNDO"}

    def start(self, context: bpy.types.Context, progress: Progress) -> Steps:
        job, outcome = _second_press(context, request_from_panel(context).job), Outcome()
        kept: list[BlockRef] = []
        uv = job.uv if job.uv == SMART else CHARTS
        show_lines(context, [])
        with chart_rollback(context, outcome.charting.changes, kept):
            try:
                kept += yield from prepared_charts(context, replace(job, uv=uv), progress, outcome)
            finally:
                _ask_for_second_press(context, outcome)
        lines = outcome.notes or ["The charts made before still fit"]
        add_lines(context, [*lines, *outcome.refused])
        for line in outcome.refused:
            self.report({"WARNING"}, line)
        self.report({"INFO"}, lines[-1])


class OCCLUSION_BAKE_OT_compare(LongOperator, bpy.types.Operator):
    """Bake AO of the selected meshes here and with Cycles, settings matched, and show both times and the difference"""

    bl_idname = "occlusion_bake.compare"
    bl_label = "Compare with Cycles"
    bl_options = {"UNDO"}

    def start(self, context: bpy.types.Context, progress: Progress) -> Steps:
        check_occluders(context)
        job = request_from_panel(context).job
        show_lines(context, [])
        # A child Blender bakes beside the window; Blender as a module has no program to start.
        compared = compare_in_child if bpy.app.binary_path and not bpy.app.background else compare_here
        samples = settings_in(context).cycles_samples
        yield from compared(context, job, samples, progress, self._finish)

    def _finish(self, context: bpy.types.Context, report: dict[str, Any]) -> None:
        entries = report["objects"]
        pictures = [show_picture(_picture_name(entry), entry["cycles"]["picture"]) for entry in entries]
        show_in_editor(context, pictures[0])
        said = _told_alone(entries[0]) if len(entries) == 1 else _told_together(entries, report["total"])
        add_lines(context, [*report["lines"], *said])
        for line in report["lines"]:
            self.report({"WARNING"}, line)
        self.report({"INFO"}, "; ".join(said[:4]) if len(entries) == 1 else said[0])


class OCCLUSION_BAKE_OT_select_overlap(bpy.types.Operator):
    """Select the active mesh's faces that share their place in the UV map with others, in Edit Mode"""

    bl_idname = "occlusion_bake.select_overlap"
    bl_label = "Select Overlapping UVs"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = view_layer_in(context).objects.active
        if obj is not None and obj.type == "MESH" and mesh_of(obj).uv_layers and library_of(mesh_of(obj)) is None:
            return True
        cls.poll_message_set("The active object is no mesh of this file with a UV map")
        return False

    def execute(self, context: bpy.types.Context) -> Ended:
        count = select_overlap(context)
        self.report(
            {"INFO"}, say("{} faces overlap in the UV map", count) if count else say("No faces overlap in the UV map")
        )
        return {"FINISHED"}


class OCCLUSION_BAKE_OT_unhook(bpy.types.Operator):
    """Take the baked images out of the selected objects' materials; what they multiplied is linked as before"""

    bl_idname = "occlusion_bake.unhook"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(has_linked_images(obj) for obj in chosen_objects(context)):
            return True
        cls.poll_message_set("No baked image is in the materials of the selected objects")
        return False

    def execute(self, context: bpy.types.Context) -> Ended:
        done = sum(unlink_images(obj) for obj in chosen_objects(context))
        self.report({"INFO"}, say("Removed from the materials of {}", _counted(done)))
        return {"FINISHED"}


class OCCLUSION_BAKE_OT_cancel(bpy.types.Operator):
    """Stop the bake; images stay as they were"""

    bl_idname = "occlusion_bake.cancel"
    bl_label = "Cancel Bake"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return running() is not None

    def execute(self, context: bpy.types.Context) -> Ended:
        progress = running()
        if progress is not None:
            progress.cancel()
        return {"FINISHED"}


def _unchanged(context: bpy.types.Context, request: BakeRequest) -> Unchanged | None:
    """What tells of textures that need not be baked again, and puts them into materials where that is asked for; None
    where all are to be baked."""
    if not settings_in(context).use_skip:
        return None
    kept = KeptImages(request.destination, request.job.settings, shown=request.preview)

    def unchanged(texture: Texture) -> bool:
        images = kept.of(texture)
        if images is None:
            return False
        if request.preview or request.gltf:
            found = zip(texture.objects, kept.objects_of(texture), texture.targets, strict=True)
            add_lines(context, link(context, request, list(found), images))
        return True

    return unchanged


def _second_press(context: bpy.types.Context, job: BakeJob) -> BakeJob:
    """Blender unwraps the objects of which the last one told that the making of their charts broke down."""
    shown = result_in(context)
    asked, shown.asked = shown.asked.split(), ""
    return replace(job, smart=frozenset(ref for ref in job.objects if str(ref.uid) in asked))


def _ask_for_second_press(context: bpy.types.Context, outcome: Outcome) -> None:
    refused = outcome.charting.refused.items()
    result_in(context).asked = " ".join(str(ref.uid) for ref, why in refused if isinstance(why, NoUnwrapper))


_Found = tuple[BlockRef, bpy.types.Object, Instance]  # an object, as it is, and as it was baked


def _still_there(result: Result, outcome: Outcome) -> list[_Found]:
    """The objects that were baked. Of an atlas those that the artist has removed or converted, or whose charts are
    removed, are refused; raises InputError where none is left."""
    found = []
    for ref, target in zip(result.objects, result.targets, strict=True):
        obj = find(bpy.data.objects, ref)
        if obj is None or obj.type != "MESH":
            gone = "removed" if obj is None else "made another kind of object"
            left = "nothing was written for it" if result.is_first else "its last tiles are not baked"
            refusal = InputError(f"{ref.label}: {gone} during the bake; {left}")
        elif ref in outcome.charting.made and outcome.charting.request.layer not in mesh_of(obj).uv_layers:
            refusal = InputError(f"{ref.label}: its UV charts were removed during the bake; bake again")
        else:
            found.append((ref, obj, target))
            continue
        if len(result.targets) == 1:
            raise refusal
        outcome.refuse(ref, refusal)
    if not found:
        raise InputError(f"{result.name}: its objects were removed during the bake; nothing was written")
    return found


def put(
    context: bpy.types.Context,
    result: Result,
    found: Sequence[_Found],
    request: BakeRequest,
    tiles: TileFiles,
) -> None:
    """The maps of a result to where they go. found: the objects that are left. tiles: keeps those of a UDIM layout
    until all are there."""
    job, destination = request.job, request.destination
    if job.layout.corners:
        store_colours(context, found[0][1], result.target, result.baked)
        return
    images = destination.deliver(result, job.settings, tiles, shown=request.preview)
    if destination.kind != CHANNEL:
        store_request(request, [ref for ref, _, _ in found], images)
        store_inputs(destination, result.inputs, images.values())
    result.baked.warnings += link(context, request, found, images)


def link(
    context: bpy.types.Context, request: BakeRequest, found: Sequence[_Found], images: Mapping[str, bpy.types.Image]
) -> list[str]:
    """Images of objects into their materials, as far as that is asked for. Returns lines on those that cannot show
    them."""
    job, destination = request.job, request.destination
    channel = destination.channel if destination.kind == CHANNEL else ""
    by_place: dict[tuple[str | None, bool], list[bpy.types.Object]] = {}
    lines: list[str] = []
    for ref, obj, target in found:
        turned = target.normal_map is not None or ref in job.highs
        by_place.setdefault((_shown_map(obj, target), turned), []).append(obj)
    for (uv, turned), objects in by_place.items():
        for obj in objects:
            lines += link_images(
                obj,
                images,
                uv,
                preview=request.preview,
                gltf=request.gltf,
                channel=channel,
                turned=turned,
                among=set(objects),
            )
            if images and request.preview:
                lines += lines_on_node_materials(context, obj)
    return lines


def _shown_map(obj: bpy.types.Object, target: Instance) -> str | None:
    """The UV map that an object was baked onto, for its materials to name; None where that is the artist's one for
    renders, which they take of themselves."""
    baked = target.mesh.uv_map
    for_renders = next((layer.name for layer in mesh_of(obj).uv_layers if layer.active_render), None)
    return None if baked == for_renders and baked not in OUR_NAMES else baked


def result_lines(baked: Baked, device: Device) -> list[str]:
    """What the panel says of one baked object."""
    entry, name = object_entry(baked, {}), baked.name if baked.tile is None else f"{baked.name} {baked.tile}"
    errors = ", ".join(f"{name.replace('_', ' ').upper()} {error_in_words(entry, name)}" for name in baked.maps)
    return [
        say(
            "{}: {:.2f} s, {:.1f} million rays, {:.1f} million a second, packets {} wide",
            name,
            entry["seconds"]["total"],
            baked.rays / 1e6,
            million_rays_per_second(entry),
            device.native_width,
        ),
        say("Error: {}", errors),
    ]


def _told_alone(entry: dict[str, Any]) -> list[str]:
    """What the panel says of a comparison of one image."""
    cycles, ours, error = entry["cycles"], entry["seconds"]["total"], error_in_words(entry, AMBIENT.name)
    return [
        say("Occlusion Bake {:.2f} s, {:.1f} rays a texel, error {}", ours, rays_per_texel(entry), error),
        say("Cycles {:.2f} s, {} samples", cycles["seconds"], cycles["samples"]),
        say("A sample takes {:.1f} times as long as a ray", times_as_long(entry)),
        _agreement(cycles),
        say("Picture: {}", _picture_name(entry)),
        *cycles["reasons"],
    ]


def _told_together(entries: Sequence[dict[str, Any]], total: dict[str, Any]) -> list[str]:
    """The same of several: all, each, and of each kind of reason to differ the first."""
    seconds = "Occlusion Bake {:.2f} s, Cycles {:.2f} s, {} samples"
    reasons: dict[str, str] = {}
    for entry in entries:
        for line in entry["cycles"]["reasons"]:
            reasons.setdefault(line.partition(":")[0], f"{_called(entry)}: {line}")
    return [
        "; ".join(
            [
                say("{} images together", total["images"]),
                say(seconds, total["own_seconds"], total["seconds"], total["samples"]),
                _agreement(total),
            ]
        ),
        *(f"{_called(entry)}: {_agreement(entry['cycles'])}" for entry in entries),
        say("Pictures: {}", first_of([_picture_name(entry) for entry in entries], _NAMED)),
        *reasons.values(),
    ]


def _called(entry: dict[str, Any]) -> str:
    return f"{entry['name']} {entry['tile']}" if "tile" in entry else str(entry["name"])


def _picture_name(entry: dict[str, Any]) -> str:
    return f"{_called(entry)} Comparison"


def _agreement(cycles: dict[str, Any]) -> str:
    return say("RMSE {:.5f}, bias {:+.5f}, p99 {:.5f}", cycles["rmse"], cycles["bias"], cycles["p99"])


def _occluders_line(names: list[str]) -> str:
    """Who blocked light, the first of them by name."""
    return say("Occluders: {}", first_of(names, _NAMED) or say("none"))


def _counted(objects: int) -> str:
    return say("1 object") if objects == 1 else say("{} objects", objects)


CLASSES = (
    OCCLUSION_BAKE_OT_bake,
    OCCLUSION_BAKE_OT_again,
    OCCLUSION_BAKE_OT_unwrap,
    OCCLUSION_BAKE_OT_compare,
    OCCLUSION_BAKE_OT_select_overlap,
    OCCLUSION_BAKE_OT_unhook,
    OCCLUSION_BAKE_OT_cancel,
)
