"""When satellites see places: limits, eligibility, accesses, and the opportunities made of them."""
