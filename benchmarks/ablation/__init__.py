"""What each strategy of ``certified`` is worth: the suite without it, and with other constants.

``strategies`` says how each is switched off, ``constants`` which numbers are halved and doubled,
``trials`` runs cases with one change each, and ``page`` writes docs/ablation.md. A strategy that
gains less than 0.2 points of gap or 10 % of time on every family does not earn its place.
"""
