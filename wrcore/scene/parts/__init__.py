"""Readers of the parts of a scene: one file per part."""
