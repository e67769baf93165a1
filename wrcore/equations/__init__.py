"""The equations of motion: model, right-hand side, energy, outputs. The interface that integrators see."""
