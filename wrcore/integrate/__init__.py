"""Time integration: methods, their tableaus, choice of steps, reference integrators."""
