"""What must hold of charts whatever is charted, with cases drawn by hypothesis."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from ....core.base.errors import InputError
from ....core.charts.unwrap import unwrap
from ..wild_bakes import WildMesh
from .defects import DEFECTS
from .judge import assert_sound
from .kinds import KINDS, ChartCase
from .polygon_mesh import PolygonMesh

PADDING = 2  # texels asked for

_SEEDS = st.integers(0, 999_999)
_wild = st.builds(
    WildMesh,
    st.sampled_from(["soup", "grid", "box", "fan", "tangle", "empty"]),
    st.integers(1, 40),
    _SEEDS,
    st.lists(
        st.sampled_from(["flat", "line", "point", "needle", "huge", "tiny", "nan", "doubled", "two-sided", "no area"]),
        max_size=1,
    ).map(tuple),
)
_kinds = st.builds(
    ChartCase,
    st.sampled_from([*KINDS]),
    st.integers(1, 64),
    _SEEDS,
    st.just("none") | st.sampled_from([*DEFECTS]),
)
chart_cases = _kinds | _wild


def charts_are_sound(case: ChartCase | WildMesh, width: int, height: int) -> None:
    """Refused in one line, or UVs in the image, none mirrored or on another, the padding kept, the density even, the
    stretch bounded, polygons whole."""
    tame = isinstance(case, ChartCase)
    mesh = case.build() if isinstance(case, ChartCase) else _polygons_of(case)
    try:
        charts = unwrap("target", *mesh, size=(width, height), padding=PADDING)
    except InputError as error:
        assert not tame, str(error)
        text = str(error)
        assert "\n" not in text and text.startswith("target: "), text
        return
    assert_sound(mesh, charts, (width, height), PADDING, most_stretch=1.1 if tame else None)


def _polygons_of(case: WildMesh) -> PolygonMesh:
    """Each triangle a polygon."""
    mesh = case.build("target")
    return PolygonMesh(mesh.vertices, mesh.triangles, np.arange(len(mesh.triangles), dtype=np.int32))
