"""The maps that can be baked: a file each, and `registry`, which lists them all."""
