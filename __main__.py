"""`python -m occlusion_bake FILE [OPTIONS]`: the command without Blender's window."""

import sys

if __name__ == "__main__":
    from .addon.cli.hard_exit import leave
    from .addon.job.stop_signals import STOPPING, interrupted_by

    try:
        with interrupted_by(STOPPING, at_once=False):  # while Blender is loaded
            from .addon.cli.batch_command import is_meant, main

            if not is_meant(sys.argv[1:]):  # that alone needs no Blender
                from .addon.cli.command import main
        status = main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.stderr.write("occlusion_bake: cancelled\n")
        status = 3
    leave(status)
