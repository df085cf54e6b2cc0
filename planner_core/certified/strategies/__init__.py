"""Who does what when: one driver for each kind of problem."""
