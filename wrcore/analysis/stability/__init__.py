"""Whether a vehicle runs stably: modes, critical speeds, limit cycles."""
