"""The web pages: static HTML, and scripts that call the public API."""
