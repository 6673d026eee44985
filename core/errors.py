"""The two ways a bake ends early, told apart from a fault of ours."""


class InputError(ValueError):
    """What came in cannot be baked.

    The message is one line that names the object, the cause and the cure; it is shown to the artist as it stands.
    """


class Cancelled(Exception):
    """The artist stopped the bake; nothing was written."""
