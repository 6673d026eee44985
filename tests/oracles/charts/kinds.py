"""The kinds of meshes that charts are tried on, each from a size and a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import defects, hard_surface, loose_pieces, organic, round_shapes
from .polygon_mesh import PolygonMesh, joined, placed, some_of

Kind = Callable[[int, int], PolygonMesh]  # size, seed


def _levels(size: int) -> int:
    """Of a ball that is halved as often as makes some size² triangles."""
    return int(np.clip(round(np.log2(max(size, 1) ** 2 / 20.0) / 2.0), 1, 7))


def _cable(size: int, seed: int) -> PolygonMesh:
    return organic.with_cable(organic.scan(_levels(size), seed), float(size))


def _foliage(size: int, seed: int) -> PolygonMesh:
    """Leaves of two kinds, and stems."""
    stems = [
        placed(round_shapes.tube(6, 4.0, rows=4), at=(2.0 * stem, 0, 0), scale=(0.05, 0.05, 1)) for stem in range(3)
    ]
    return joined([loose_pieces.leaves(2 * size, seed), loose_pieces.leaves(size, seed + 1, 3, 3), *stems])


def _holed_soup(size: int, seed: int) -> PolygonMesh:
    mesh = organic.scan(_levels(size), seed)
    return some_of(mesh, loose_pieces.chosen_faces(mesh, 0.5, seed))


# Size is the number of sides, pieces or cells along the mesh, so that most have some size to size² triangles.
KINDS: dict[str, Kind] = {
    "tube": lambda size, seed: round_shapes.tube(max(size, 3), 1.0 + seed % 5, rows=1 + seed % 3),
    "closed tube": lambda size, seed: round_shapes.tube(max(size, 3), 1.0 + seed % 5, closed=True),
    "cone": lambda size, seed: round_shapes.cone(max(size, 3), 0.5 + seed % 4, base=False),
    "closed cone": lambda size, seed: round_shapes.cone(max(size, 3), 0.5 + seed % 4),
    "ring": lambda size, seed: round_shapes.ring(max(size, 3), 0.2 + 0.15 * (seed % 5)),
    "torus": lambda size, seed: round_shapes.torus(max(size, 3), max(3, size // 3), 0.1 + 0.1 * (seed % 6)),
    "dome": lambda size, seed: round_shapes.dome(max(size, 3), 2 + seed % 8),
    "capsule": lambda size, seed: round_shapes.capsule(max(size, 3), 3 + seed % 5, 0.5 * (seed % 9)),
    "spring": lambda size, seed: round_shapes.spring(max(size, 3), 0.5 + seed % 4, 12),
    "thread": lambda size, seed: round_shapes.thread(max(size, 3), 1 + seed % 6),
    "round parts": lambda size, seed: round_shapes.round_parts(max(size, 3)),
    "quads": lambda size, seed: loose_pieces.loose_quads(size, seed),
    "quads of many sizes": lambda size, seed: loose_pieces.loose_quads(size, seed, 20.0),
    "triangles": loose_pieces.loose_triangles,
    "leaves": loose_pieces.leaves,
    "foliage": _foliage,
    "hair cards": loose_pieces.hair_cards,
    "voxels": lambda size, seed: loose_pieces.voxels(_cells(size), seed),
    "joined voxels": lambda size, seed: loose_pieces.voxels(_cells(size), seed, shared=True),
    "checkerboard": lambda size, seed: loose_pieces.checkerboard(max(1, int(np.sqrt(size)))),
    "islands on one point": lambda size, seed: loose_pieces.islands_on_one_point(size, seed, float(seed % 2)),
    "fan of pieces": loose_pieces.fan_of_pieces,
    "scan": lambda size, seed: organic.scan(_levels(size), seed, 0.3, 0.1 * (seed % 4)),
    "half a scan": _holed_soup,
    "terrain": lambda size, seed: organic.terrain(size, seed, 0.5 * (1 + seed % 6)),
    "star": lambda size, seed: organic.star(_levels(size), seed, 3 + seed % 6),
    "character": lambda size, seed: organic.character(max(size, 16)),
    "handles": lambda size, seed: organic.handles(max(size // 2, 8), seed, 1 + seed % 3),
    "cable": _cable,
    "bevelled box": lambda size, seed: hard_surface.bevelled_box(size % 5, 0.1, (2.0, 1.0 + seed % 3, 0.5)),
    "stairs": lambda size, seed: hard_surface.stairs(max(1, size // 4)),
    "plate": lambda size, seed: hard_surface.plate(1 + seed % 3, 4 * max(1, size // 8)),
    "gear": lambda size, seed: hard_surface.gear(max(3, size)),
    "prism": lambda size, seed: hard_surface.prism(max(3, size), 0.2 + seed % 3),
    "part": lambda size, seed: hard_surface.part(max(4, size // 2)),
    "fins": lambda size, seed: defects.fins(max(1, size // 3), 1 + seed % 4),
    "T-junctions": lambda size, seed: defects.t_junctions(size),
    "bow tie": lambda size, seed: defects.bow_tie(max(1, int(np.sqrt(size)))),
    "Moebius": lambda size, seed: defects.moebius(max(3, size), 1 + seed % 4),
    "Klein": lambda size, seed: defects.klein(max(4, size), max(4, size // 3)),
    "needles": lambda size, seed: defects.needles(size, seed, 10.0 ** -(seed % 6)),
    "one triangle": lambda size, seed: defects.one_triangle(),
    "collinear": lambda size, seed: defects.collinear_polygon(max(5, size)),
}


# Of a few hundred triangles, for tests that lay out each of them often.
PLAIN: dict[str, PolygonMesh] = {
    "cube": hard_surface.cube(),
    "sphere": round_shapes.sphere(),
    "prism": hard_surface.prism(9),
    "waves": organic.waves(),
    "rough": organic.waves(noise=0.2),
}


def _cells(size: int) -> int:
    """Along a block of voxels that has some `size` faces a layer."""
    return max(1, round(float(np.cbrt(size))))


@dataclass(frozen=True)
class ChartCase:
    """The recipe of a mesh to chart: keys of KINDS and of defects.DEFECTS. It prints as one line."""

    kind: str
    size: int
    seed: int = 0
    defect: str = "none"

    def build(self) -> PolygonMesh:
        return defects.spoiled(KINDS[self.kind](self.size, self.seed), self.defect, self.seed)
