"""From Blender's scene to plain arrays."""
