"""What is timed over commits: see `costs`."""
