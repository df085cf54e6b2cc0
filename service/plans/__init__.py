"""Plans in operations: their storage, and their permitted transitions."""
