"""Rigid contact geometry: first touch, conicity, and heights at a given load."""
