"""Run a scene: integration, output channels, run files, choice of accuracy and progress bars."""
