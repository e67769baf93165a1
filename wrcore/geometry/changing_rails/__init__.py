"""Rails that change along the track, described by slices from files or made by formulas."""
