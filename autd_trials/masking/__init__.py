"""Pink noise, its level, its player."""
