"""Where baked maps go in Blender: images, attributes, materials."""
