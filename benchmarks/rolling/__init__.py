"""Seven days in closed loop: plans are made, flown in a world with random failures, and remade."""
