"""Computing time of evaluations and runs: comparisons, stages, growth with size, and limits of the machine."""
