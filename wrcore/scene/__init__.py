"""Scenes: check a scene file, fill in its defaults and compile it to a model."""
