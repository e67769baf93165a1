"""Rigid bodies, their joints, and the forces that joints need."""
