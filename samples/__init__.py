"""Scenes made by script, to try the bake on: `python -m occlusion_bake.samples suzanne --folder DIR`."""
