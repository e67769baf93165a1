"""Normal problem of a contact patch: pressure on strips."""
