"""Occlusion Bake: ambient and reflection occlusion, with the error of the result.

Blender is touched only inside `register`, so that `occlusion_bake.core` imports anywhere.
"""


def register() -> None:
    """Add the operators, panels and command to Blender."""
    from . import addon

    addon.register()


def unregister() -> None:
    """Take them away again."""
    from . import addon

    addon.unregister()
