"""The strategies of the certified search, for each kind of problem."""
