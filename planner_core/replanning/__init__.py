"""A plan that follows another one: what is flown stays, and as little else changes as must."""
