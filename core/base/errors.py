"""The two ways a bake ends early, told apart from a fault of ours."""


class InputError(ValueError):
    """What came in cannot be baked.

    The message is one line that names the object, the cause and the cure; it is shown to the artist as it stands.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message.encode(errors="backslashreplace").decode())  # names of files can hold any byte


class NoUnwrapper(InputError):
    """A mesh needs UV charts and we cannot make them, for a reason that is not the mesh's own: Blender's unwrap may."""

    def __init__(self, name: str, why: str) -> None:
        self.why = why
        super().__init__(
            f"{name}: it needs UV charts and {why}; for Blender's own unwrap press Bake or Make UV Charts again, or "
            "choose Smart UV Project as the UV map (in the command: --uv smart)"
        )


class Cancelled(Exception):
    """The artist stopped the bake; nothing was written."""
