"""Functions of direction: lobes, harmonics, masks, environments, and the maps and tables that hold them."""
