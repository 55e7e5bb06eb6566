"""The planned comparisons by other models and adjustments, to see whether the choice matters."""
