"""Mixed-integer programs: relaxations, cuts, proofs by HiGHS, merging of plans."""
