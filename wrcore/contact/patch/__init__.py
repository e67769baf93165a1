"""One solved patch of any shape: `result` (fields and forces), `model` (settings and scratch), `solution`."""
