"""Response of a vehicle to forces, irregularity, curves and cant, without integration over time."""
