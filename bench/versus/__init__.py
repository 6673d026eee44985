"""Seconds against error: ours beside the bakers that others have, on the same texels of the same scenes."""
