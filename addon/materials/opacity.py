"""What a material lets through, read from its nodes as Cycles evaluates them for a shadow ray.

Only what reaches the opacity is followed, and no image is read that does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from .image_pixels import ImagePixels
from .node_evaluator import NodeEvaluator
from .node_links import Path, SocketSource, nodes_of, socket_source, unread
from .texel_values import TexelValues, bent, clipped, constant, grey, mapped, mix


@dataclass(frozen=True)
class Opacity:
    """What a material lets through. note: what of it is taken for something else, in words that fit after its name."""

    texels: TexelValues
    note: str = ""


def opacity_of(material: bpy.types.Material | None, pixels: ImagePixels) -> Opacity:
    """A material's opacity to shadow rays: values from 0 to 1. Raises Unread."""
    tree = None if material is None or not material.use_transparent_shadow else nodes_of(material)
    output = None if tree is None else tree.get_output_node("CYCLES")
    if output is None:
        return Opacity(constant(1.0))
    surface, volume = (socket_source(output.inputs[name], ()) for name in ("Surface", "Volume"))
    if surface.node is None and volume.node is not None:
        return Opacity(constant(0.0), "it is a volume alone; light passes through it as if it were clear")
    reader = _Reader(pixels)
    texels = reader.shader(output.inputs["Surface"], ())
    return Opacity(replace(texels, values=clipped(texels.values)), reader.note)


class _Reader(NodeEvaluator):
    """Evaluates the shaders of one material. note: as of `Opacity`."""

    def __init__(self, pixels: ImagePixels) -> None:
        super().__init__(pixels)
        self.note = ""

    def shader(self, socket: Any, path: Path) -> TexelValues:
        """The opacity of what feeds a shader socket. Raises Unread."""
        source = socket_source(socket, path)
        if source.node is None:
            return constant(1.0)
        handler = _SHADERS.get(source.node.type)
        if handler is not None:
            return handler(self, source)
        if source.node.type in _OPAQUE or source.node.type.startswith("BSDF_"):
            return constant(1.0)
        raise unread(source.node)

    def principled(self, source: SocketSource) -> TexelValues:
        """Its alpha."""
        alpha = self.number(source.node.inputs["Alpha"], source.path)
        return replace(alpha, values=clipped(alpha.values))

    def transparent(self, source: SocketSource) -> TexelValues:
        """Clear where white. A colour would tint the light; here it is as dark as it looks."""
        colour = self.colour(source.node.inputs["Color"], source.path)
        if np.ptp(colour.values, axis=2).max() > 1e-3:
            self.note = "its transparency is coloured; light passes as if it were grey"
        return mapped(lambda grey: 1.0 - np.clip(grey, 0.0, 1.0), grey(colour))

    def mix_shader(self, source: SocketSource) -> TexelValues:
        """Between its two shaders; one that does not count is not read."""
        factor, first, second = source.node.inputs
        share = self.number(factor, source.path)
        share = replace(share, values=clipped(share.values))
        if share.is_all(0.0) or share.is_all(1.0):
            return self.shader(first if share.is_all(0.0) else second, source.path)
        return mix(share, self.shader(first, source.path), self.shader(second, source.path))

    def add_shader(self, source: SocketSource) -> TexelValues:
        """What either lets through."""
        first, second = (self.shader(socket, source.path) for socket in source.node.inputs)
        if first.is_all(1.0) and second.is_all(1.0):
            return first
        return bent(lambda a, b: np.maximum(a + b - 1.0, 0.0), first, second)


_SHADERS: dict[str, Callable[[_Reader, SocketSource], TexelValues]] = {
    "BSDF_PRINCIPLED": _Reader.principled,
    "BSDF_TRANSPARENT": _Reader.transparent,
    "MIX_SHADER": _Reader.mix_shader,
    "ADD_SHADER": _Reader.add_shader,
}

# To shadow rays, measured; with all others of the name BSDF.
_OPAQUE = {"EMISSION", "HOLDOUT", "SUBSURFACE_SCATTERING", "BACKGROUND", "EEVEE_SPECULAR"}
