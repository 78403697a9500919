"""What to change: describing functions, limit cycles, rules and recommendations. Imports identification alone."""
