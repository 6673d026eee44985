"""RO as a share of what an open surface would get: what a leaning lobe loses below the horizon, divided out.

RO of an open plane is not 1 where the reflected direction leans towards the horizon, but H_e(α) of
`estimators.open_horizon`. That is right for light that is not there below the horizon; divided by it, an open point is
1 from every view.
"""

from __future__ import annotations

import numpy as np

from ..scene.scene import Camera, Doubles, Floats, Ints, Placed
from ..texels.rasterize import surface_points

_STEPS = 1 << 13  # the table is linear between them: 6e-8 off at most
_FAR = 12.0  # of cos(x)^e as good as nothing lies beyond so many times 1/√e: e^-72


def open_horizon(exponent: float, cosines: Doubles) -> Doubles:
    """H_e(α) = 1 − ∫₀^α sinᵉ / ∫₀^π sinᵉ for each cos α, as `estimators.open_horizon`, of any exponent ≥ 0.

    cosines: any shape, 0 to 1; below 0 they are taken for 0, the horizon, where half of the lobe is left. Interpolated
    in a table: to 1e-6, and to 1e-5 for exponents below 0.5. With φ = π/2 − α it is ½ + ½ ∫₀^φ cosᵉ / ∫₀^{π/2} cosᵉ.
    """
    elevations = np.linspace(0.0, min(0.5 * np.pi, _FAR / np.sqrt(max(exponent, 1.0))), _STEPS + 1)
    middles = 0.5 * (elevations[1:] + elevations[:-1])
    lobe, between = _cosine_power(elevations, exponent), _cosine_power(middles, exponent)
    pieces = lobe[:-1] + 4.0 * between + lobe[1:]  # Simpson's rule; the width cancels
    integral = np.concatenate([[0.0], np.cumsum(pieces)])
    openness: Doubles = 0.5 + 0.5 * np.interp(
        np.arcsin(np.clip(cosines, 0.0, 1.0)), elevations, integral / integral[-1]
    )
    return openness


def cosines_to_reflected(surface: Placed, owner: Ints, camera: Camera, *, threads: int = 0) -> Doubles:
    """cos α between the shading normal and R = d − 2(d·n)n, d the view of the texel: (H, W) float64.

    owner: (H, W) int32. camera: in the frame of the surface. Taken at the middle of each texel's footprint; below 0
    where that faces away from the camera, and 0 where there is no owner.
    """
    positions, normals = (each.astype(np.float64) for each in surface_points(surface, owner, threads=threads))
    view = camera.views(positions)
    length = np.linalg.norm(view, axis=-1)
    along = -np.einsum("ijk,ijk->ij", view, normals)  # R·n = −d·n
    cosines: Doubles = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    return cosines


def divide(sums: Floats, openness: Doubles) -> None:
    """Divide a map's sums, in place, by what an open surface would get; both of one shape, openness above 0.

    The estimate stays unbiased, so that noise may carry a value above 1. Texels without a value (-1) stay so.
    """
    np.divide(sums, openness, out=sums, where=sums > 0.0, casting="same_kind")


def _cosine_power(angles: Doubles, exponent: float) -> Doubles:
    """cosᵉ, by log cos x = log1p(−2 sin²(x/2)): the cosine of a small angle would lose what a large exponent needs."""
    with np.errstate(divide="ignore", invalid="ignore"):
        power: Doubles = np.exp(exponent * np.log1p(-2.0 * np.sin(0.5 * angles) ** 2))
    return np.where(angles >= 0.5 * np.pi, float(exponent == 0.0), power)
