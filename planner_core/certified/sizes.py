"""How large tables and arrays may be, so that a machine can hold them, and pauses in seconds.

Larger ones are counted more coarsely or not tried; this makes no plan or bound wrong.
"""

from __future__ import annotations

from typing import Final

MAX_CELLS: Final = 36_000_000
"""Cells of one satellite's table over tasks and units of worth."""

MAX_DATA_CELLS: Final = 9_000_000
"""Cells of all satellites' tables over tasks and data levels: 100 epochs take some seconds."""

MAX_STEPS: Final = 500_000_000
"""Near pairs of a satellite times units of worth in a quick bound: this many take seconds."""

MAX_PAIRS: Final = 8_000_000
"""Near pairs of tasks in a program, of about 100 bytes each; followers in tables of starts."""

MAX_FOLLOWERS: Final = 30_000_000
"""Followers that a search with continuous starts keeps, of 12 bytes each."""

MAX_DATA_LEVELS: Final = 1200
MAX_ENERGY_LEVELS: Final = 1500
"""Levels of a recorder and, at a time, of a battery."""

MAX_LAYERS: Final = 48
"""Groups of contacts between which images come down."""

MAX_UNITS: Final = 2**29
"""Units of worth that a path through queues may gain, or any path pay at its end: 32 bits."""

MAX_QUEUE_WORK: Final = 20_000_000_000
"""Entries that a programme of queues updates: 20 s with one promise, a minute with three."""

MAX_QUEUE_ENTRIES: Final = 100_000_000
"""Entries that it keeps at a time, of 4 bytes each."""

QUEUE_STEPS: Final = 4
MAX_QUEUE_STEPS: Final = 20_000
"""Steps of data in which a queue is listed: in a level of data, and at most in a contact."""

PROMISES: Final = 3
"""Contacts of which a path promises one to bring down what the next one has no time for. With 1
bounds were 0.3 and 0.4 % higher at half-lives of 3 and 12 h, with 5 the same."""

FEW_CONTACTS: Final = 20
"""Contacts of a satellite among which a programme of queues finds the best within a second."""

NEXT_CONTACTS: Final = 8
"""Contacts after an image that a program tells apart. With all of them programs take half as long
again, and bounds are no lower."""

MEMORY_BITS: Final = 128
"""Targets that a label may remember."""

OPENING_LEVELS: Final = 9
"""Levels of the table of tasks by opening time: ranges of up to 2**8 s."""

WINDOW_NODES: Final = 8192
"""Nodes that a window may span; ``WINDOW_WORDS`` hold the targets with several nodes in it."""
WINDOW_WORDS: Final = 16

RESOURCE_WINDOW_NODES: Final = 1024
"""Nodes of a window under battery and recorder, with so many labels for each."""
LABELS_PER_TASK: Final = 5

MAX_VERDICTS: Final = 32
"""Verdicts of the referee that a search keeps, since it finds the same plans again."""

LABELS_PER_CELL: Final = 2
"""Labels in each cell of start times."""

ROUTE_LABELS: Final = 20_000
ROUTE_BUCKETS: Final = 4096
ROUTE_TASKS: Final = 64
"""Labels, buckets and tasks of a window with continuous starts."""

LARGE_PROGRAM: Final = 5000
"""Columns above which an interior point method finds an optimum of the relaxation sooner."""

CLIQUE_STEPS: Final = 2000
"""Steps of the search for one clique cut; a good one ends it earlier."""

LOG_CHARACTERS: Final = 6000
"""Characters from the end of the log of HiGHS that are kept as a proof."""

POLL_S: Final = 0.02
PAUSE_S: Final = 0.25
"""Between checks on HiGHS; between reports, and before abandoning a HiGHS that does not stop."""

MAX_STARTS: Final = 1000
"""How far apart the seeds of two starts of a search lie."""

SLOT_S: Final = 120.0
"""Length of the slots into which a relaxation for continuous starts divides the horizon. With a
quarter of it bounds are 0.1 to 0.9 % lower, after three to four times the time."""

APART_S: Final = 5.0
"""The least time between two starts that a search samples in an access. With 15 s small missions
end after two seconds with up to 4 % less."""

SLOWER: Final = 0.99
"""At most this share of the rate at which a satellite turns is the rate of lines of sight in bounds
with continuous starts. At 0.8 two slow satellites have a bound of 625.6, at 0.99 of 598.2."""
