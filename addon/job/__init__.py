"""One bake from Blender, in steps that leave the window alive."""
