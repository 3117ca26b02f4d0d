"""Pictures and pages, drawn from the folder of a run alone."""
