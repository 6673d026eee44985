"""The two ways a bake ends early, told apart from a fault of ours."""


class InputError(ValueError):
    """What came in cannot be baked.

    The message is one line that names the object, the cause and the cure; it is shown to the artist as it stands.
    """


class NoUnwrapper(InputError):
    """A mesh needs UV charts and there is no xatlas to make them."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"{name}: it needs UV charts and this Blender's Python has no xatlas to make them; press Bake again "
            "for Blender's own unwrap, Smart UV Project (in the command: --uv smart)"
        )


class Cancelled(Exception):
    """The artist stopped the bake; nothing was written."""
