"""The physics: air, transducers, field, focus."""
