"""Triangles by their corners: normals, areas, and how their UVs stretch."""

from __future__ import annotations

import numpy as np

from .arrays import Doubles, Floats
from .vectors import unit


def tangents(corners: Doubles, uv: Doubles) -> tuple[Doubles, Doubles]:
    """(n, 3) each: how the point moves with u and with v, for triangles (n, 3, 3) and their UVs (n, 3, 2)."""
    p, q = corners[:, 1:] - corners[:, :1], uv[:, 1:] - uv[:, :1]
    double = (q[:, 0, 0] * q[:, 1, 1] - q[:, 0, 1] * q[:, 1, 0])[:, None]
    along_u = (p[:, 0] * q[:, 1, 1, None] - p[:, 1] * q[:, 0, 1, None]) / double
    along_v = (p[:, 1] * q[:, 0, 0, None] - p[:, 0] * q[:, 1, 0, None]) / double
    return along_u, along_v


def area_of(corners: Doubles) -> Doubles:
    """(n,) area of triangles (n, 3, 3)."""
    area: Doubles = 0.5 * np.sqrt(square(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])))
    return area


def uv_area_of(uv: Doubles) -> Doubles:
    """(n,) signed area of triangles (n, 3, 2), positive counter-clockwise."""
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area: Doubles = 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    return area


def texels_of(uv: Floats, width: int, height: int) -> Doubles:
    """(n,) how many texels of such an image triangles with (n, 3, 2) UVs are as large as."""
    texels: Doubles = np.abs(uv_area_of(uv.astype(np.float64) * (width, height)))
    return texels


def square(vectors: Doubles) -> Doubles:
    total: Doubles = (vectors * vectors).sum(axis=-1)
    return total


def unit_normals(corners: Doubles) -> Doubles:
    """(N, 3) unit normals, by the right-hand rule, of triangles with (N, 3, 3) corners; zero for one without area."""
    return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
