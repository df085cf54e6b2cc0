"""How large tables and arrays may be, so that a machine can hold them, and pauses in seconds.

What is larger is counted more coarsely or not tried; no plan or bound becomes wrong by it.
"""

from __future__ import annotations

from typing import Final

MAX_CELLS: Final = 36_000_000
"""Of one satellite's table over tasks and units of worth."""

MAX_DATA_CELLS: Final = 9_000_000
"""Of all satellites' tables over tasks and levels of data: a hundred epochs take some seconds."""

MAX_STEPS: Final = 500_000_000
"""Of a satellite's near pairs times units of worth, in a bound that is to be quick: seconds."""

MAX_PAIRS: Final = 8_000_000
"""Of tasks near each other in a program, of about 100 bytes each; followers in tables of starts."""

MAX_FOLLOWERS: Final = 30_000_000
"""Kept by a search with continuous starts, of 12 bytes each."""

MAX_DATA_LEVELS: Final = 1200
MAX_ENERGY_LEVELS: Final = 1500
"""Of a recorder and, at a time, of a battery."""

MAX_LAYERS: Final = 48
"""Groups of contacts between which images come down."""

MAX_UNITS: Final = 2**29
"""Of worth that a path through queues may gain, or any path pay at its end: counted in 32 bits."""

MAX_QUEUE_WORK: Final = 20_000_000_000
"""Entries that a programme of queues raises: 20 s with one promise, a minute with three."""

MAX_QUEUE_ENTRIES: Final = 100_000_000
"""That it keeps at a time, of 4 bytes each."""

QUEUE_STEPS: Final = 4
MAX_QUEUE_STEPS: Final = 20_000
"""In a level of data, by which its queue is told, and in a contact."""

PROMISES: Final = 3
"""Of which contact brings down what the next one has no time for. With 1 bounds were 0.3 and 0.4 %
higher at half-lives of 3 and 12 h, with 5 the same."""

FEW_CONTACTS: Final = 20
"""Of a satellite, among which a programme of queues finds the best in a second or less."""

NEXT_CONTACTS: Final = 8
"""After an image, that a program tells apart. With all of them programs take half as long again,
with bounds as low."""

MEMORY_BITS: Final = 128
"""Targets that a label may remember."""

OPENING_LEVELS: Final = 9
"""Of the table of what opens: ranges of up to 2**8 s."""

WINDOW_NODES: Final = 8192
"""That a window may span; ``WINDOW_WORDS`` hold the targets in it more than once."""
WINDOW_WORDS: Final = 16

RESOURCE_WINDOW_NODES: Final = 1024
"""The same under battery and recorder, with so many labels for each."""
LABELS_PER_TASK: Final = 5

MAX_VERDICTS: Final = 32
"""Of the referee on plans, kept by a search that comes to the same ones again."""

LABELS_PER_CELL: Final = 2
"""Of start times."""

ROUTE_LABELS: Final = 20_000
ROUTE_BUCKETS: Final = 4096
ROUTE_TASKS: Final = 64
"""Of a window with continuous starts."""

LARGE_PROGRAM: Final = 5000
"""Columns, beyond which an interior point method finds an optimum of the relaxation sooner."""

CLIQUE_STEPS: Final = 2000
"""Of the search for one clique cut, which any good one ends."""

LOG_CHARACTERS: Final = 6000
"""Of HiGHS, kept as the end of a proof."""

POLL_S: Final = 0.02
PAUSE_S: Final = 0.25
"""Between two looks at HiGHS; between two reports, and until one that does not stop is left."""

MAX_STARTS: Final = 1000
"""Of one search: how far apart the seeds of two searches lie."""
