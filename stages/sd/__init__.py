"""Stable Diffusion and its ControlNet: files, conventions, loading. Needs the extra `sd`."""
