"""Rails that change along the track, as slices: from files, and made by formulas."""
