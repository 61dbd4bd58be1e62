"""Stage 2: cameras, and depth, normals and light transport for each."""
