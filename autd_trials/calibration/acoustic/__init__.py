"""Acoustic refinement: poses from the phases at which single transducers are heard at known points."""
