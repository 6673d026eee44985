"""How the estimators of occlusion converge: `python -m occlusion_bake.samples.study` measures and writes README.md."""
