"""How good a bake is to be, by name: the error that each name stands for."""

from __future__ import annotations

PRESETS = {"draft": 1 / 50, "good": 1 / 255, "final": 1 / 510}  # RMSE; 1/255 is a step of an 8-bit image
DEFAULT = "good"
