"""What the bench bakes: several objects one below the other, and a low mesh from a high one, by ours and by Cycles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.compare import projected  # noqa: E402
from occlusion_bake.bench.cycles import DEFAULT_SAMPLES  # noqa: E402
from occlusion_bake.bench.seen_surface import sees_one_surface  # noqa: E402
from occlusion_bake.bench.subject import Subject, subject_of, textures_of  # noqa: E402
from occlusion_bake.bench.versus.bakers import (  # noqa: E402
    CYCLES,
    EMBREEX,
    OURS_ERROR,
    OURS_RAYS,
    Outcome,
    bakers,
    refusal,
    settings_of,
)
from occlusion_bake.bench.versus.reference import trace_reference  # noqa: E402
from occlusion_bake.core.rays.map_spec import AO, reflection  # noqa: E402
from occlusion_bake.tests.oracles.blender import mesh, plane  # noqa: E402

SIZE = 32
ALL = {baker.name: baker for baker in bakers(AO, settings_of)}
STEP = 0.05  # high, in the middle of the high mesh


@pytest.fixture(autouse=True)
def empty() -> Iterator[None]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield


def two_planes() -> Subject:
    """One in the open, and one of which a roof a hair above takes all light; the first in two hundred metres."""
    plane("Open", location=(200.0, 0.0, 0.0))
    plane("Covered")
    corners = ((-50.0, -50.0, 0.01), (50.0, -50.0, 0.01), (50.0, 50.0, 0.01), (-50.0, 50.0, 0.01))
    mesh("Roof", corners, ((0, 1, 2, 3),))
    return subject_of(("Open", "Covered"), SIZE)


def step_from_high() -> Subject:
    """A flat low mesh, and a high one below its left half and above its right one, with a riser that faces left."""
    plane("Flat", location=(0.0, 0.0, 0.2 * STEP))
    x = (-1.0, 0.0, 0.0, 1.0)
    z = (0.0, 0.0, STEP, STEP)
    corners = [(a, y, b) for a, b in zip(x, z, strict=True) for y in (-1.0, 1.0)]
    mesh("Step", corners, [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(3)])
    return subject_of(("Flat",), SIZE, ("Step",))


def bake_by(subject: Subject, baker: str, setting: str) -> Outcome:
    return ALL[baker].bake(subject, setting, 0)


@pytest.mark.parametrize(("baker", "setting"), [(OURS_RAYS, "4"), (CYCLES, "1"), (EMBREEX, "4")])
def test_several_objects_stand_one_below_the_other(baker: str, setting: str) -> None:
    subject = two_planes()
    if baker == EMBREEX and refusal(ALL[baker], subject):
        pytest.skip("embreex is not there")
    found = bake_by(subject, baker, setting)
    assert found.values.shape == found.covered.shape == (2 * SIZE, SIZE)
    assert found.covered.all()
    assert (found.values[:SIZE] == 1.0).all()
    assert (found.values[SIZE:] == 0.0).all()


def test_what_is_told_of_several_objects_is_of_all_their_texels() -> None:
    subject = two_planes()
    made = subject.bake(rays=4, filtered=False)
    errors = [result.maps["ao"].error for _, result in made.results]
    found = textures_of(made)
    assert found.error == pytest.approx(np.sqrt(np.mean(np.square(errors))))  # as many texels in each
    assert found.rays == sum(result.rays for _, result in made.results) == 4 * 2 * SIZE**2
    assert found.p99 is None
    assert subject.label == "2 objects"


@pytest.mark.parametrize(("baker", "rays"), [(OURS_RAYS, 256), (CYCLES, 64)])
def test_the_low_mesh_is_baked_from_the_high_one(baker: str, rays: int) -> None:
    """Half a texel before a riser of height h, at d from it, the share 1 - (1 - d / √(d² + h²)) / 2 of the light is
    left, and behind it all. The low mesh, though it lies over one half of the other, takes none.

    The mean of 16 texels is off by 4.5 standard errors of independent rays with p = 7e-6; Cycles spreads its samples
    over the texel, which changes the mean of so curved a function by less than 0.03."""
    subject = step_from_high()
    assert [each.name for each in subject.scene.occluders] == ["Step"]
    found = bake_by(subject, baker, str(rays))
    foot = found.values[SIZE // 4 : 3 * SIZE // 4, SIZE // 2 - 1]
    d = 1.0 / SIZE
    left = 1.0 - 0.5 * (1.0 - d / np.hypot(d, STEP))
    assert foot.mean() == pytest.approx(left, abs=4.5 * 0.5 / np.sqrt(rays * len(foot)) + 0.03 * (baker == CYCLES))
    assert (found.values[:, SIZE // 2 + 1 :][found.covered[:, SIZE // 2 + 1 :]] == 1.0).all()


def test_the_low_mesh_alone_has_all_light() -> None:
    step_from_high()
    bpy.data.objects["Step"].hide_render = True
    assert (bake_by(subject_of(("Flat",), SIZE), OURS_RAYS, "16").values == 1.0).all()


def test_where_the_high_mesh_steps_within_a_texel_cycles_is_not_compared() -> None:
    subject = step_from_high()
    (target,) = subject.scene.targets
    one = sees_one_surface(target, subject.scene.highs[target.name], subject.owner)
    beside = np.zeros_like(one)
    beside[:, SIZE // 2 - 1 : SIZE // 2 + 1] = True
    assert np.array_equal(one, ~beside)
    assert not subject.same[beside].any()
    assert (subject.same | beside).all()
    assert subject.covered.all()  # ours is compared there, too


def test_ours_to_an_error_is_as_far_off_the_reference_as_it_says() -> None:
    subject = step_from_high()
    against = trace_reference(subject, AO, 4096)
    found = bake_by(subject, OURS_ERROR, "1/100")
    assert found.error is not None
    rmse = float(np.sqrt(np.mean((found.values - against.values)[found.covered] ** 2)))
    assert rmse < 3.0 * found.error + against.noise


def test_a_reference_is_of_the_map_asked_for() -> None:
    subject = step_from_high()
    ao, ro = (trace_reference(subject, spec, 64).values for spec in (AO, reflection(100.0)))
    assert ao[:, SIZE // 2 - 1].mean() < ro[:, SIZE // 2 - 1].mean() - 0.02  # a narrow lobe sees over the step


def test_a_script_does_not_bake_from_high_meshes() -> None:
    why = refusal(ALL[EMBREEX], step_from_high())
    assert why is not None and "\n" not in why
    assert refusal(ALL[CYCLES], step_from_high()) is None


def test_defaults_are_of_bakes_from_high_meshes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[bool, int]] = []
    subject = step_from_high()

    def run(*_: object, **__: object) -> float:
        cycles = bpy.context.scene.cycles
        seen.append((cycles.use_adaptive_sampling, cycles.samples))
        return 0.0

    monkeypatch.setattr(projected, "run_bake", run)
    bake_by(subject, CYCLES, "16")
    bake_by(subject, CYCLES, "adaptive")
    assert seen == [(False, 16), (True, DEFAULT_SAMPLES)]
