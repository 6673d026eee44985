"""Where the compiled kernel lies; `occlusion_bake.core.base.kernel_api` loads it."""

from pathlib import Path


def library_path() -> Path:
    """The shared library. Raises FileNotFoundError where the package holds none."""
    for path in sorted(Path(__file__).parent.glob("libocclusion_kernel.*")):
        return path
    raise FileNotFoundError(f"no kernel library in {Path(__file__).parent}; run `make venv`")
