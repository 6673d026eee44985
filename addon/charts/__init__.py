"""UV charts for Blender's meshes, in maps of their own."""
