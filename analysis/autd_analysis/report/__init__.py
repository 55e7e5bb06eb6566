"""The report: one HTML file with everything, to read, print and paste from."""
