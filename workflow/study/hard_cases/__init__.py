"""What every hard case must keep, and where the methods break."""
