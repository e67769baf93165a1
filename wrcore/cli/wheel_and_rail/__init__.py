"""Commands about profiles, contact and creep forces, without a simulation."""
