"""Force elements: one file per kind in `wrcore.elements.kinds`, with all that the core knows of it."""
