"""`python -m occlusion_bake FILE [OPTIONS]`: the command without Blender's window."""

import sys

if __name__ == "__main__":
    from .addon.cli.command import main
    from .addon.cli.hard_exit import leave

    leave(main(sys.argv[1:]))
