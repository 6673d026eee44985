"""Why our AO and Cycles' may differ though all settings match: what is known, as far as it applies."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import bpy
import numpy as np

from ..core.report import first_of
from ..core.scene import Floats

_NAMED = 4  # materials in a line


def reasons_to_differ(
    values: Floats, samples: int, other_owner: int, occluders: Collection[str], of_our_own: Collection[str] = ()
) -> list[str]:
    """A line for each. values: (N,) float32, our AO of the compared texels. other_owner: texels that Cycles gives to
    another triangle. occluders: names of the objects that block light. of_our_own: settings that
    Cycles lacks."""
    noise = float(np.sqrt(np.mean(values * (1.0 - values), dtype=np.float64) / samples))
    lines = [f"Noise: Cycles' {samples} samples alone may make an RMSE of up to {noise:.4f}"]
    if other_owner:
        lines.append(
            f"Edges: {other_owner} texels show another triangle in Cycles, which looks at their middle; here the one "
            "that covers most of them counts"
        )
    if bpy.app.version < (5, 0):
        lines.append("Footprint: Cycles before Blender 5 samples the middle half of a texel, here the whole of it")
    lines += [f"Settings: {what}, which Cycles' bake has not" for what in of_our_own]
    if names := sorted({material.name for material in _materials(occluders) if _lets_light_through(material)}):
        lines.append(f"Materials: {first_of(names, _NAMED)} let light through in Cycles; here all are opaque")
    return lines


def _materials(names: Collection[str]) -> Iterator[bpy.types.Material]:
    for name in names:
        obj = bpy.data.objects.get(name)
        yield from (slot.material for slot in obj.material_slots if slot.material) if obj is not None else ()


def _lets_light_through(material: bpy.types.Material) -> bool:
    """Whether its nodes may be transparent to Cycles' shadow rays."""
    nodes: Any = material.node_tree.nodes if material.node_tree is not None else ()
    return any(node.type == "BSDF_TRANSPARENT" or _has_alpha(node) for node in nodes)


def _has_alpha(node: Any) -> bool:
    alpha = node.inputs.get("Alpha") if node.type == "BSDF_PRINCIPLED" else None
    return alpha is not None and (alpha.is_linked or alpha.default_value < 1.0)
