"""What anybody asks of their own runs and scenes: motion, wheel forces, modes, critical speeds, contact, plots."""
