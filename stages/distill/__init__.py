"""Stage 3: the material, optimised."""
