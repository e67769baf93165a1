"""Root loci, modes and limit cycles."""
