"""Whether a planned difference depends on the other factor: interaction and trend."""
