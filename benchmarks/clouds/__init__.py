"""The value of a clear-sky forecast: plans with and without it under the same weather."""
