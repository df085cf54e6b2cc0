"""What can be wrong with a request: the kinds of problems, and the location of each cause."""
