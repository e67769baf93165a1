"""Contact of wheel and rail: position, pressure and friction of contact patches."""
