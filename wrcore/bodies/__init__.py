"""Rigid bodies, joints between them, and the reaction forces of the joints."""
