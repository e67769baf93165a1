"""Where wheel and rail touch, and how hard."""
