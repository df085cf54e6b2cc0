"""What other owners notice while one attacks the service (``python -m benchmarks.attack``)."""
