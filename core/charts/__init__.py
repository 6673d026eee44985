"""UV charts: made where a mesh has none, mended, packed; and the tiles of UDIM layouts."""
