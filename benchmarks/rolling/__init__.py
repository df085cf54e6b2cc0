"""Seven days in closed loop: plans are made, flown by a world with luck of its own, and remade."""
