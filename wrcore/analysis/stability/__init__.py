"""Running stability of a vehicle: modes, critical speeds and limit cycles."""
