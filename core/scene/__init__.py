"""What a bake is given: meshes and their places in the world, what materials do to light and normals, the ground."""

from .scene import Camera, Highs, Instance, Mesh, Placed, Scene

__all__ = ["Camera", "Highs", "Instance", "Mesh", "Placed", "Scene"]
