"""What `dreammat report` can be told."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ReportOptions:
    """Options of the conditions report."""

    size: int = 512
    """pixels along each side of the view that is measured"""
    env: tuple[str, ...] = ()
    """as for `conditions`; empty for the five built-in environments"""
    seed: int = 0
    """of the camera and of the measured rays; the converged result uses others"""
    mitsuba: str = ""
    """a Python interpreter that has the package mitsuba; empty for no side-by-side"""
    cycles: str = ""
    """a Python interpreter that has the package bpy (Blender); empty for no side-by-side"""
