"""Equations of motion: model, right-hand side, energy, outputs, and the interface for integrators."""
