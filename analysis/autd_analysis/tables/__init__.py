"""The results as tables, a module for each kind of results."""
