"""Where wheel and rail overlap, and the overlaps' depth, place and curvature."""
