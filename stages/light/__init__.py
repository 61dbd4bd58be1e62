"""Rays, environments, light transport; `reference.py` is the slow, obvious form of `transport.py`."""
