"""How much each strategy of ``certified`` contributes: the suite without it, with other constants.

``strategies`` says how each is switched off, ``constants`` which numbers are halved and doubled,
``trials`` runs cases with one change each, and ``page`` writes docs/ablation.md. A strategy that
gains less than 0.2 points of gap or 10 % of time on every family should be removed.
"""
