"""The files of a run, and resuming from them. Nothing here computes or draws."""
