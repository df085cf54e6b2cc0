"""Planning many satellites together: prices that they share, and a search that heeds them."""
