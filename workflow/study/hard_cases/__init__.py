"""Hard cases: invariants that every simulation must satisfy, and the limits of the methods."""
