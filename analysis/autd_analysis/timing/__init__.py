"""Whether stimuli came when they were planned, and how fast people answered."""
