"""Computing speed against error of every modelling and integration choice."""
