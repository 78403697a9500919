"""Numbers that decide what explains a recording, each with unit, range, meaning and source."""
