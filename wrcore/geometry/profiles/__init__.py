"""Profiles of wheels and rails: named ones, files of points, checks, smoothing."""
