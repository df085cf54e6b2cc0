"""What can be wrong with a request: each kind of problem, and where its cause stands."""
