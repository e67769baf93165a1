"""Error and computing time of every choice of contact model, creep law and integrator on a scene."""
