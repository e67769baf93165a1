"""The paper's figures, its comparison and its timing table."""
