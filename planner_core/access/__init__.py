"""When satellites see sites: limits, eligibility, accesses, and opportunities made from them."""
