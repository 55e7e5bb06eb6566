"""Tables of answers that others recorded: read as they come, and what was taken for something is said."""
