"""Where a vehicle stands and how it begins: static equilibrium, steady running, the state at the start."""
