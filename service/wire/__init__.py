"""What goes over HTTP: one model for each thing, for the API, its document and the client.

Pydantic alone is needed. The models are closed where we write: a field that is not declared
cannot be sent. `base.read` opens them for readers, who ignore what a newer service adds.
"""
