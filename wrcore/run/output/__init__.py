"""Results of a run: channels with their units and descriptions, and run files."""
