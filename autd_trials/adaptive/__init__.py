"""Which level comes next: adaptive methods, as functions of the answers so far and of nothing else."""
