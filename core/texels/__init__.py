"""The texels of a surface: where they lie, which way they look, what they are baked from."""
