"""What is left of a run: channels, their units and meaning, files."""
