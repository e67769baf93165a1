"""Rolling friction in a contact patch: on strips of any patch, and on ellipses."""
