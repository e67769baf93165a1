"""The report and the notebooks."""
