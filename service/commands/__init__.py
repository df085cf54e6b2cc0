"""What the program ``slewline`` does: one module for each command, and what they share."""
