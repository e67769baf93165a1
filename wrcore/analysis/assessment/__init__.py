"""What standards and engineers ask of a run: forces, ride, safety."""
