"""Prompts read as recipes (grammar, tables), and the embedded diffusion model with its weights."""
