"""Vehicles from vehicle files: bodies, joints and force elements."""
