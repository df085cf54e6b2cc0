"""Large neighbourhood search: parts of a plan destroyed and repaired."""
