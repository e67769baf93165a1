"""Speed against error of every choice."""
