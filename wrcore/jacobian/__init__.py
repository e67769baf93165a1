"""Jacobian of the equations of motion, and block elimination of its linear systems."""
