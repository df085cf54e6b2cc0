"""The figures of ``certified``, frozen: the same cases before and after a change of the engine.

``families`` defines the missions, ``engine`` plans one case, ``rows`` stores its result, and
``compare`` puts two files side by side. ``python -m benchmarks.suite`` runs what is missing.
"""
