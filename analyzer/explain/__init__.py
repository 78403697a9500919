"""From a recording to its explanation, stored and told."""
