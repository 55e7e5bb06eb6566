"""How likely a study of a given size shows what it is to show: whole studies, simulated and tested."""
