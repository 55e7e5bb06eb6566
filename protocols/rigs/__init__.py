"""The shipped rig files."""
