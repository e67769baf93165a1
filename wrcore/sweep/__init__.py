"""Parameter sweeps: many runs of one scene, their plan, their batches and the measures of each run."""
