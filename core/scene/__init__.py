"""What a bake is given: meshes and their places in the world, what materials do to light and normals, the ground."""

from .scene import Camera, HighPoly, Instance, Mesh, Scene

__all__ = ["Camera", "HighPoly", "Instance", "Mesh", "Scene"]
