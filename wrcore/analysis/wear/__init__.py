"""Wear and rolling contact fatigue of wheels and rails."""
