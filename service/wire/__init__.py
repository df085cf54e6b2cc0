"""Everything sent over HTTP: one model each, for the API, its OpenAPI document and the client.

This package needs only Pydantic. The models are strict for writers: undeclared fields cannot be
sent. `base.read` relaxes them for readers, who ignore what a newer service adds.
"""
