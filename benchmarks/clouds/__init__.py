"""What a forecast of clear skies is worth: plans with and without it under the same weather."""
