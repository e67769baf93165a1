"""What wheels run on: the track's moving frame, track that gives, check rails, rails that change along the track."""
