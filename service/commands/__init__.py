"""The commands of the program ``slewline``: one module for each, and what they share."""
