"""How one owner's attack affects other owners (``python -m benchmarks.attack``)."""
