"""What a run leaves on disk, and how it goes on from there. Nothing here computes or draws."""
