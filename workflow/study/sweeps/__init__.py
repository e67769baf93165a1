"""Many short runs in one table."""
