"""Geometry of wheels, rails and track: profiles, changing rails, path, irregularity."""
