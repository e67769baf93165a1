"""The tangential (creep) force: every law behind one signature."""
