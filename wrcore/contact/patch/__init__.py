"""Solution of one contact patch: `result` (fields, forces), `model` (settings, work arrays), `solution`."""
