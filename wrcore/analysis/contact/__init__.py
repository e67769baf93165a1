"""Contact of a wheelset at single positions and attitudes, outside a simulation."""
