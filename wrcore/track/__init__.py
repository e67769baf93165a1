"""Models of the track: its moving frame, flexible track, check rails, and rails that change along the track."""
