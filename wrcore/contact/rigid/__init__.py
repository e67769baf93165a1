"""Contact without elasticity: first touch, conicity, heights at a load."""
