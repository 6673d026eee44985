"""`python -m occlusion_bake FILE [OPTIONS]`: the command without Blender's window."""

import sys

if __name__ == "__main__":
    from .addon.cli.hard_exit import leave
    from .addon.job.stop_signals import STOPPING, interrupted_by

    try:
        with interrupted_by(STOPPING, at_once=False):  # while Blender is loaded
            from .addon.cli import batch_command

            if not batch_command.is_meant(sys.argv[1:]):  # which needs no Blender
                from .addon.cli import command
        status = (batch_command if batch_command.is_meant(sys.argv[1:]) else command).main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.stderr.write("occlusion_bake: cancelled\n")
        status = 3
    leave(status)
