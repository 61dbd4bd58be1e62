"""Artefact files, BRDF, shading, colour, frames, threads, errors. Imports nothing of ours."""
