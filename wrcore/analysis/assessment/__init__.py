"""Assessment of a run by standards: wheel forces, ride comfort and safety against derailment."""
