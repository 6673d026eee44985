"""How the estimators of occlusion converge: `python -m occlusion_bake.bench.study` measures and writes README.md."""
