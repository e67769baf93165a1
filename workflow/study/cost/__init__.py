"""What things cost: timed in turn in one process, stage by stage, over size, and against the machine's limits."""
