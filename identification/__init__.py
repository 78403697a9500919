"""What a loop is, how it behaves, how it is found from its trends. Imports none of the other packages."""
