"""Contact search: overlaps of wheel and rail, and their penetration, position and curvature."""
