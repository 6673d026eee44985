"""All the hard cases, in the order of the page."""

from __future__ import annotations

from . import charts, faces, heights, normals, sizes

CASES = (*faces.CASES, *sizes.CASES, *normals.CASES, *charts.CASES, *heights.CASES)
