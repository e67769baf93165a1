"""Commands that make the data and the weights of the surrogate of exact contact; the workflow does not run them."""
