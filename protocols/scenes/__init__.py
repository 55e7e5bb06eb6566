"""Made-up scenes that synthetic sensors see, and how those sensors are mounted."""
