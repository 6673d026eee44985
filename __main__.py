"""`python -m occlusion_bake FILE [OPTIONS]`: the command without Blender's window."""

import sys

if __name__ == "__main__":
    from .addon.command import main

    raise SystemExit(main(sys.argv[1:]))
