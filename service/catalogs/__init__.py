"""Target catalogues that ship with the package."""
