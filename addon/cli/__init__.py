"""The command, with and without Blender's window."""
