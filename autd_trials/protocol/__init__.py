"""What is to be done: the YAML's schema, loading with line-numbered errors, the plan."""
