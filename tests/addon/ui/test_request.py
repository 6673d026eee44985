"""What an image tells of how it was baked, in files that anybody may have made."""

from __future__ import annotations

import json
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.ui.request import KEPT, request_from_image  # noqa: E402
from occlusion_bake.addon.ui.request_renewal import renew  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, set_panel  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene", "registered", "unmeasured")


@pytest.fixture
def image() -> Any:
    set_panel(width=16, height=16, quality="RAYS", rays=1, margin=0)
    blender.plane()
    bake_onto("Plane")
    return bpy.data.images["Plane AO"]


def refused(image: Any, words: str) -> None:
    with pytest.raises(InputError, match=f"^Plane AO: it .*{words}.*; bake its object anew$"):
        request_from_image(bpy.context.view_layer, image)


def test_no_kept_setting_of_another_kind_is_taken(image: Any) -> None:
    whole = json.loads(image[KEPT])
    assert request_from_image(bpy.context.view_layer, image).panel == whole["panel"]
    for name, value in whole["panel"].items():
        for other in (None, [], {}, "none", 7, True):
            if type(other) is not type(value) and not (type(value) is float and other == 7):
                image[KEPT] = json.dumps({**whole, "panel": {**whole["panel"], name: other}})
                refused(image, "another version")
    image[KEPT] = json.dumps({**whole, "panel": {**whole["panel"], "depth": "none"}})
    refused(image, "another version")


@pytest.mark.parametrize("kept", ["", "[]", "[" * 100_000, '{"panel": 3}', 5])
def test_what_is_no_order_is_told(image: Any, kept: object) -> None:
    image[KEPT] = kept
    refused(image, "does not tell")
    renew()  # as when the file is saved
    assert image[KEPT] == kept


@pytest.mark.parametrize("name", ["highs", "targets", "excluded", "occluders"])
@pytest.mark.parametrize("other", [3, "x", [[]], [9], [{"low": [0], "meshes": [0], "cage": [], "extrusion": "x"}]])
def test_kept_roles_that_are_none(image: Any, name: str, other: object) -> None:
    whole = json.loads(image[KEPT])
    image[KEPT] = json.dumps({**whole, "roles": {**whole["roles"], name: other}})
    refused(image, "another version")
