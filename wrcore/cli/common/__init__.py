"""What several commands share: options, files that they write."""
