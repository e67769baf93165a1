"""Friction in a patch that rolls: by strips, and on ellipses."""
