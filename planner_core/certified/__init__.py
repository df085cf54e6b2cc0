"""Plans with a proof: a plan and a bound that close in on each other."""
