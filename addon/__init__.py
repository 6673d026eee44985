"""Everything that touches Blender: what is read from it, what is shown in it, what is written to it."""
