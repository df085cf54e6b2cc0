"""The JSON form of the proof of a bound."""

from __future__ import annotations

from pydantic import Field

from service.wire.base import Wire


class MultipliersOut(Wire):
    """Multipliers of targets, and of sets of opportunities of which a plan takes at most one."""

    prices: tuple[float, ...]
    cuts: tuple[tuple[tuple[int, ...], ...], ...]
    cut_prices: tuple[float, ...]


class RefutationOut(Wire):
    """A proof that no plan earns some amount: multipliers, then the two cases of a branch."""

    steps: tuple[MultipliersOut, ...]
    branch: tuple[int, RefutationOut, RefutationOut] | None = Field(
        None, description="An opportunity; the case that it is taken, and the case that it is not."
    )


class RowMultipliersOut(Wire):
    """Multipliers of rows of the whole program as a linear program, and of clique cuts."""

    rows: tuple[int, ...] = Field(description="Rows of the program; all others have 0.")
    prices: tuple[float, ...] = Field(
        description="A multiplier for each of these rows: that of its upper limit if above 0, that "
        "of its lower limit if below 0."
    )
    cliques: tuple[tuple[int, ...], ...] = Field(
        description="Opportunities of one satellite that exclude each other pairwise."
    )
    clique_prices: tuple[float, ...]
    of_slots: bool = Field(
        description="Whether the rows are those of the program over slots of time, in which images "
        "may start anywhere in a slot and turns are left out."
    )


class ProofOut(Wire):
    """The proof of a bound, which planner_core checks without any search."""

    version: int
    proof: str = Field(description="`milp`, `lagrangian`, `dp`, `linear` or `totals`.")
    value: float = Field(description="The bound.")
    prices: tuple[float, ...] | None = Field(
        None, description="A multiplier for each target, in the order of the scenario."
    )
    contact_prices: tuple[float, ...] | None = Field(
        None,
        description="With a half-life: a multiplier for the data that each contact downlinks, per "
        "recorder capacity, in the order of opportunities. All 0 if batteries alone prove it.",
    )
    antenna_prices: tuple[float, ...] | None = Field(
        None,
        description="A multiplier for each group of contacts that compete for the same antennas, "
        "by station and in order of time.",
    )
    queue_levels: int | None = Field(
        None,
        description="With a half-life: the number of energy levels per collect, if dynamic "
        "programmes over the recorder's queue prove the bound.",
    )
    exact_contacts: tuple[int, ...] | None = Field(
        None,
        description="With `queue_levels`: the contacts, by index among the opportunities, whose "
        "energy the programmes do not round.",
    )
    elementary: bool | None = Field(
        None, description="Whether the prices are for paths that image a target once in each pass."
    )
    unit: float | None = Field(
        None,
        description="With battery and recorder: the unit in which worth is counted, rounded up.",
    )
    cell_s: float | None = Field(
        None, description="With continuous starts: the width of the cells of start times."
    )
    row_prices: RowMultipliersOut | None = Field(
        None,
        description="If the linear relaxation of the whole program proves the bound, or that of "
        "the program over slots of time.",
    )
    amount: float | None = Field(None, description="The reward that `refutation` rules out.")
    refutation: RefutationOut | None = None
    log: str | None = Field(None, description="Log of the solver that proved it, if one did.")
    on_board: float | None = Field(
        None,
        description="Part of the value: the most that images on board at the start can earn. The "
        "proof covers the rest.",
    )
