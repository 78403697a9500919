"""What to change: describing functions, limit cycles, rules, recommendations."""
