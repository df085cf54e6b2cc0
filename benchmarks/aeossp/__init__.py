"""Standard agile scheduling cases (AEOSSP, GitHub Mtrya/astro-reason), planned and verified."""
