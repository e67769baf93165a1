"""Equivalent sections for rails that change along the track and for wheels out of round."""
