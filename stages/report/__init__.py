"""Measures speed against error of every part."""
