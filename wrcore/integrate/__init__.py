"""Time integration: steppers, their tableaus, Jacobian and block elimination, reference integrators."""
