"""Analysis of runs and scenes: assessment, contact, response, stability, wear and plots."""
