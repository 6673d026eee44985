"""How far a bake is, and stopping it. Nothing here measures time: what counts is the rays that were not traced."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import pytest
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.errors import Cancelled
from occlusion_bake.core.base.kernel_api import Control
from occlusion_bake.core.progress import Progress, Stages
from occlusion_bake.core.rays.embree import open_device
from occlusion_bake.core.rays.map_spec import AO
from occlusion_bake.core.rays.occluders import Occluders
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.rays.trace_scene import Geometry, TraceScene
from occlusion_bake.core.rays.tracer import TraceOptions, trace
from occlusion_bake.core.scene.scene import Scene
from occlusion_bake.core.scene.world_mesh import world_mesh
from occlusion_bake.core.texels.rasterize import rasterize
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings


class Watcher:
    """Looks at a bake again and again from another thread while the body of `with` runs."""

    def __init__(self, look: Callable[[], None]) -> None:
        self._look = look
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        while not self._over.wait(0.0005):
            self._look()

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()


@pytest.fixture
def stage() -> Scene:
    """Two objects far enough apart that each gets its own frame."""
    near, far = (shapes.instance(shapes.sphere(segments=48), shapes.matrix((x, 0, 0)), f"at {x}") for x in (0, 50))
    return Scene([near, far], [near, far])


def test_the_fraction_rises_from_0_to_1(stage: Scene) -> None:
    progress = Progress()
    seen = [progress.fraction]
    with Watcher(lambda: seen.append(progress.fraction)):
        for baked in bake(stage, flat_settings(width=256, height=256, rays=256), progress):
            seen.append(progress.fraction)
            assert seen[-1] == (0.5 if baked.name == "at 0" else 1.0)
    assert seen[0] == 0.0 and progress.fraction == 1.0
    assert seen == sorted(seen)
    assert any(0.1 < fraction < 0.5 for fraction in seen) and any(0.6 < fraction < 1.0 for fraction in seen)


def test_the_fraction_is_whole_objects_and_the_share_of_a_stage() -> None:
    progress = Progress(4)
    assert progress.fraction == 0.0
    control = progress.enter("Rock: tracing", (0.2, 1.0))
    assert progress.fraction == pytest.approx(0.05)
    control.done, control.total = 500, 1000
    assert progress.fraction == pytest.approx(0.15)
    assert progress.stage == "Rock: tracing"
    control.done = 0  # as when a stage measures a second piece of work
    assert progress.fraction == pytest.approx(0.15)
    for done in range(1, 5):
        progress.finish_object()
        assert progress.fraction == done / 4


def test_stages_without_a_share_do_not_count() -> None:
    progress = Progress()
    control = progress.enter("reading the scene")
    control.done = control.total = 10
    assert progress.fraction == 0.0


def test_stages_before_others_take_a_share_of_what_is_left(stage: Scene) -> None:
    progress = Progress()
    stages = Stages(progress, stage.targets[0], (0.2, 1.0), plain=False)
    first = stages.before(0.5)
    for _ in range(20):
        control = first.enter("tracing")
        control.done = control.total = 1
    assert progress.fraction == pytest.approx(0.6, abs=1e-5)
    control = stages.enter("tracing")
    control.done = control.total = 1
    assert progress.fraction == pytest.approx(0.8)


def test_a_bake_is_cancelled_from_another_thread(stage: Scene) -> None:
    progress = Progress()
    most = [0, 0]  # rays done and to do

    def look() -> None:
        if progress.stage.endswith("tracing") and progress.control.done > 0:
            progress.cancel()
        if progress.control.cancel:
            most[:] = max(most[0], progress.control.done), max(most[1], progress.control.total)

    rays = 1 << 15
    settings = flat_settings(width=256, height=256, rays=rays)
    baker = bake(stage, settings, progress)
    with Watcher(look), pytest.raises(Cancelled):
        next(baker)
    assert most[1] > 2e9  # rays that would have been traced
    assert 0 < most[0] < most[1] / 8
    assert progress.fraction < 1.0


def test_a_cancelled_bake_does_not_go_on(stage: Scene) -> None:
    progress = Progress(2)
    baker = bake(stage, flat_settings(width=16, height=16, rays=4), progress)
    assert next(baker).name == "at 0"
    progress.cancel()
    with pytest.raises(Cancelled):
        next(baker)


def test_nothing_starts_once_cancelled(stage: Scene) -> None:
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        progress.enter("anything")
    with pytest.raises(Cancelled):
        next(bake(stage, flat_settings(width=16, height=16), progress))


def test_every_kernel_call_looks_at_the_wish(stage: Scene) -> None:
    stopped = Control(cancel=1)
    target = world_mesh(stage.targets[0], np.zeros(3))
    scene = TraceScene(open_device())
    scene.add(target.vertices, target.triangles)
    with pytest.raises(Cancelled):
        scene.commit(stopped)
    with pytest.raises(Cancelled):
        Geometry(open_device(), target.vertices, target.triangles, stopped)
    scene = TraceScene(open_device())
    scene.add(target.vertices, target.triangles)
    scene.commit()
    assert target.uv is not None
    owner = rasterize("sphere", target.uv, 16, 16).owner
    with pytest.raises(Cancelled):
        trace(scene, TexelSurface(target, owner), [AO], TraceOptions(4), control=stopped)
    assert stopped.done == 0


def test_a_tree_is_built_to_its_end_and_the_wish_heeded_then() -> None:
    """Embree could be stopped in the midst, by exceptions through TBB that other threads did not outlive on Windows."""
    target = world_mesh(shapes.instance(shapes.sphere(segments=600), shapes.matrix(), "large"), np.zeros(3))
    scene, control = TraceScene(open_device()), Control()
    scene.add(target.vertices, target.triangles)

    def wish() -> None:
        control.cancel = int(control.total > 0)  # once it has begun

    with Watcher(wish), pytest.raises(Cancelled):
        scene.commit(control)
    assert control.done == control.total
    scene.commit()
    inwards = np.float32([[0.0, 0.0, -1.0]])
    assert not scene.visible(-2.0 * inwards, inwards)[0]


def test_building_occluders_is_cancelled(stage: Scene) -> None:
    progress = Progress()
    progress.cancel()
    occluders = Occluders(open_device(), stage.occluders)
    with pytest.raises(Cancelled):
        occluders.frame_for(stage.targets[0], control=progress.control)
    frame = occluders.frame_for(stage.targets[0])
    assert frame.flat | frame.instanced == {0, 1}


def test_the_map_can_be_looked_at_while_it_is_made(stage: Scene) -> None:
    """It fills in with values that are right to a few rays' noise, and ends as the finished one."""
    progress, seen = Progress(), []

    def look() -> None:
        preview = progress.preview
        values = None if preview is None else preview.values()
        if values is not None:
            seen.append((preview.target.name, values))

    settings = flat_settings(width=256, height=256, error=0.004)
    with Watcher(look):
        finished = {baked.name: baked for baked in bake(stage, settings, progress)}
    assert progress.preview is None
    for name, baked in finished.items():
        own = [values for target, values in seen if target == name]
        result = baked.maps["ao"]
        traced = [values[result.covered & (values >= 0.0)] for values in own]
        assert traced[0].size < traced[-1].size == result.covered.sum()  # it began with what was not traced yet
        right = result.values[result.covered]
        assert np.sqrt(np.mean((traced[-1] - right) ** 2)) < 0.05
        assert all(values.min() >= -1.0 and values.max() <= 1.0 for values in own)


def test_no_preview_outlives_its_bake(stage: Scene) -> None:
    progress = Progress()
    for baked in bake(stage, flat_settings(width=32, height=32, rays=4), progress):
        assert progress.preview is None, baked.name


def test_the_rate_and_what_is_left_are_told_once_they_are_known() -> None:
    progress = Progress()
    assert progress.rays_per_second is None and progress.seconds_left is None
    control = progress.enter("Rock: tracing", (0.0, 1.0), rays=True)
    assert progress.rays_per_second is None
    control.total, control.done = 1000, 500
    rate, left = progress.rays_per_second, progress.seconds_left
    assert rate is not None and rate > 0.0 and left is not None and left > 0.0
    progress.enter("Rock: filtering", (0.5, 1.0))
    control.total, control.done = 1000, 500
    assert progress.rays_per_second is None  # what is filtered are no rays
