"""What lasts: the event log, reading it back, the BIDS data set."""
