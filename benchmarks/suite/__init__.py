"""The figures of ``certified``, frozen: the same cases before and after a change of the engine.

``families`` says what is planned, ``engine`` plans one case, ``rows`` keeps what it came to, and
``compare`` lays two files side by side. ``python -m benchmarks.suite`` runs what is missing.
"""
