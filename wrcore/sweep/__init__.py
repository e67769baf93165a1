"""Many runs of one scene: the plan, its batches, what is kept of each run."""
