"""Uploaded files of points and values: from bytes to records, each fault with its location."""
