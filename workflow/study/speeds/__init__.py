"""Wheelset and trailer vehicle over speed, planar and spatial."""
