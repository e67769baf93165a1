"""Whether a run stayed where its models and inputs are valid."""
