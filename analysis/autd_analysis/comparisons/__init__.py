"""The planned comparisons within participants."""
