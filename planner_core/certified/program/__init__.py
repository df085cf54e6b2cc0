"""The planning model as a linear program with integer variables, without any solver."""
