"""Every patch model against exact contact, in one pose and in runs, and exact contact against CONTACT."""
