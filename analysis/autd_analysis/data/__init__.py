"""Trials from a study's folder or any table, the design, and what is odd about them."""
