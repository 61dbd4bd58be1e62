"""A material from words alone, without a mesh."""
