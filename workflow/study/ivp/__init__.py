"""A published benchmark of rigid wheelset dynamics (index-2 differential-algebraic equations)."""
