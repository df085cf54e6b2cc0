"""Planning without resources: prices, window search, cutting planes and the proof."""
