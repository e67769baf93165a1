"""Rigid bodies, joints, force elements and time integration."""
