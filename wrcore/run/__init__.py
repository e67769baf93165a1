"""A scene under way and what is left of it: integration, output, files, choice of accuracy, progress."""
