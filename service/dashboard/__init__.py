"""The pages that people see: static HTML, and scripts that call the public API."""
