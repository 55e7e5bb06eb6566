"""Detection and false-alarm rates, of each participant and over participants."""
