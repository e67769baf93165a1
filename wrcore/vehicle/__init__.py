"""Vehicles from data: bodies, joints and elements."""
