"""Measured signals: reading of files, units, filters, resampling and alignment with a run."""
