"""Stage 4: textures, model, preview and report."""
