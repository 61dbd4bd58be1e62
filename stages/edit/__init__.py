"""A baked asset changed afterwards: colour, roughness and metallic, per part or whole, and every file that follows."""
