"""Uploaded files of points and values: from bytes to records, every fault with its place."""
