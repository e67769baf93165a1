"""Time integration: methods, their tableaus, step size control, reference integrators."""
