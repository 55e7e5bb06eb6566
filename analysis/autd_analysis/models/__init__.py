"""Models of single answers: logistic mixed models and what stands in where they fail."""
