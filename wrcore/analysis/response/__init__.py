"""How a vehicle answers forces, irregularity, curves and cant, without integration over time."""
