"""Where the units are."""
