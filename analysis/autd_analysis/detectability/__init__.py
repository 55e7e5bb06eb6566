"""d' and criterion, where there are catch trials."""
