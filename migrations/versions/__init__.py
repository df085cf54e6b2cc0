"""One file per step; each is applied once, in order."""
