"""How far the making of charts is, in the bar and in words, and its end by Escape."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts import chart_layout  # noqa: E402
from occlusion_bake.addon.charts.chart_marks import ATLAS_MAP, is_ours  # noqa: E402
from occlusion_bake.addon.charts.rollback import chart_rollback  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, Layout, bake_steps, prepared_charts  # noqa: E402
from occlusion_bake.addon.job.outcome import Outcome  # noqa: E402
from occlusion_bake.addon.job.runner import run  # noqa: E402
from occlusion_bake.addon.ui.modal_operator import progress_words  # noqa: E402
from occlusion_bake.core.base.errors import Cancelled, NoUnwrapper  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def job_of(*names: str, atlas: str = "", size: int = 32) -> BakeJob:
    return BakeJob(blender.refs(*names), flat_settings(width=size, height=size, rays=1), layout=Layout(atlas))


def uvs(obj: Any) -> list[bytes]:
    """Of every UV map."""
    return [blender.uv_of(obj.data, layer.name).tobytes() for layer in obj.data.uv_layers]


def watched(monkeypatch: pytest.MonkeyPatch, look: Callable[[str], None]) -> None:
    """Call `look` with the name of each stage of charts, in the thread that they are made in."""
    reach = Progress.reach

    def spied(self: Progress, share: float, stage: str) -> None:
        reach(self, share, stage)
        look(stage)

    monkeypatch.setattr(Progress, "reach", spied)


def baked(job: BakeJob, progress: Progress) -> None:
    run(bake_steps(bpy.context, job, progress, Outcome(), lambda _: None), progress)


def test_charts_are_a_part_of_the_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    """As large as the bake of an object for each layout that is made; those that fit take none of it."""
    blender.bare_cube("One")
    blender.bare_cube("Two", location=(5, 0, 0))
    progress, seen = Progress(), []
    watched(monkeypatch, lambda stage: seen.append((stage, progress.fraction)))
    baked(job_of("One", "Two"), progress)
    fractions = [fraction for _, fraction in seen]
    assert fractions == sorted(fractions) and progress.fraction == 1.0
    of_two = [fraction for stage, fraction in seen if stage.startswith("Two: ")]
    assert seen[0][1] == 0.0 and of_two[0] >= 0.25 and fractions[-1] <= 0.5
    assert {stage.partition(": ")[0] for stage, _ in seen} == {"One", "Two"}
    seen.clear()
    again = Progress()
    baked(job_of("One", "Two"), again)
    assert not seen and again.fraction == 1.0


def test_charts_alone_are_all_of_the_bar() -> None:
    blender.bare_cube("One")
    progress = Progress()
    run(prepared_charts(bpy.context, job_of("One"), progress, Outcome()), progress)
    assert progress.fraction == 1.0


def test_the_stage_is_told_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a mesh that takes long enough: those of a cube are over before they are asked for."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, calc_uvs=False)
    bpy.context.object.name = "One"
    progress, words = Progress(), []
    watched(monkeypatch, lambda _: words.append(progress_words(progress)[0]))
    baked(job_of("One"), progress)
    assert all(each.startswith("One: ") for each in words) and len(set(words)) > 1


@pytest.mark.parametrize("stage", ["making UV charts", "looking for charts", "packing charts"])
def test_escape_in_a_stage_leaves_nothing_behind(
    stage: str, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """Of an atlas of one object's own charts and another's new ones, that was made before for another size."""
    mapped, bare = blender.plane("Mapped"), blender.bare_cube("Bare", location=(5, 0, 0))
    if stage == "making UV charts":  # before the process is heard; later stages are too short to be sure to be
        before = [[], ["UVMap"]]
    else:
        request.getfixturevalue("charts_here")
        baked(job_of("Mapped", "Bare", atlas="Set", size=64), Progress())
        before = [[ATLAS_MAP], ["UVMap", ATLAS_MAP]]
    charts = [uvs(obj) for obj in (bare, mapped)]
    progress, outcome = Progress(), Outcome()
    watched(monkeypatch, lambda now: progress.cancel() if now == f"Set: {stage}" else None)
    steps = bake_steps(bpy.context, job_of("Mapped", "Bare", atlas="Set"), progress, outcome, lambda _: None)
    with pytest.raises(Cancelled), chart_rollback(bpy.context, outcome.charting.changes, outcome.finished):
        run(steps, progress)
    assert progress.control.cancel
    assert [[layer.name for layer in obj.data.uv_layers] for obj in (bare, mapped)] == before
    assert [uvs(obj) for obj in (bare, mapped)] == charts
    assert all(is_ours(obj.data, ATLAS_MAP) for obj in (bare, mapped) if ATLAS_MAP in obj.data.uv_layers)


def test_a_breakdown_of_one_is_no_end_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    blender.bare_cube("Bad")
    blender.bare_cube("Good", location=(5, 0, 0))
    unwrap = chart_layout.unwrap_in_process

    def broken(name: str, *arguments: Any, **options: Any) -> Any:
        if name == "Bad":
            raise NoUnwrapper(name, "the process that makes them crashed")
        return unwrap(name, *arguments, **options)

    monkeypatch.setattr(chart_layout, "unwrap_in_process", broken)
    progress, outcome = Progress(), Outcome()
    run(bake_steps(bpy.context, job_of("Bad", "Good"), progress, outcome, lambda _: None), progress)
    assert [ref.label for ref in outcome.finished] == ["Good"] and progress.fraction == 1.0
    assert (
        len(outcome.refused) == 1
        and "Bad: it needs UV charts and the process that makes them crashed" in outcome.refused[0]
    )


def test_the_command_tells_the_stages_of_charts(bake: Any) -> None:
    """A line for each, where it is no terminal; none for each share."""
    blender.bare_cube("Bare")
    run_ = bake()
    stages = [line.split("%", 1)[1].strip() for line in run_.out.splitlines() if "%  Bare: " in line]
    charts = [stage for stage in stages if "charts" in stage]
    assert len(charts) > 0 and len(set(charts)) == len(charts)
