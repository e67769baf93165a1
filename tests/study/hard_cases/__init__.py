"""A reduced set of the hard cases; every row of the study that is run here must pass or name a known limit."""
