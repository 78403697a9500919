"""What was found, as curves to draw."""
