"""Stage 1: a mesh, read, checked, mended and unwrapped."""
