"""Where there is land."""
