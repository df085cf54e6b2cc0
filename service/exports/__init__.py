"""The formats in which a timeline is available: one module each, from documents to text."""
