"""What proves a bound, as it is written down."""

from __future__ import annotations

from pydantic import Field

from service.wire.base import Wire


class MultipliersOut(Wire):
    """Multipliers of targets, and of sets of opportunities of which a plan has at most one."""

    prices: tuple[float, ...]
    cuts: tuple[tuple[tuple[int, ...], ...], ...]
    cut_prices: tuple[float, ...]


class RefutationOut(Wire):
    """What shows that no plan earns as much: multipliers, and what a branch leaves to show."""

    steps: tuple[MultipliersOut, ...]
    branch: tuple[int, RefutationOut, RefutationOut] | None = Field(
        None, description="An opportunity; the case that it is taken, and that it is not."
    )


class ProofOut(Wire):
    """What proves a bound: planner_core checks it without any search."""

    version: int
    proof: str = Field(description="The argument: `milp`, `lagrangian`, `dp` or `totals`.")
    value: float = Field(description="The bound.")
    prices: tuple[float, ...] | None = Field(
        None, description="A multiplier for each target, in the order of the scenario."
    )
    contact_prices: tuple[float, ...] | None = Field(
        None,
        description="With a half-life: a multiplier for what each contact takes down, by recorder "
        "capacity, in the order of the opportunities. All 0 where batteries alone prove it.",
    )
    antenna_prices: tuple[float, ...] | None = Field(
        None,
        description="A multiplier for each group of contacts that want the same antennas at a "
        "time, by station and in order of time.",
    )
    queue_levels: int | None = Field(
        None,
        description="With a half-life: the levels of energy in a collect, where programmes that "
        "know the queue of the recorder prove the bound.",
    )
    exact_contacts: tuple[int, ...] | None = Field(
        None,
        description="With `queue_levels`: the contacts, by their place among the opportunities, "
        "whose energy the programmes do not round.",
    )
    elementary: bool | None = Field(
        None, description="Whether the prices are for paths that take a target once in each pass."
    )
    unit: float | None = Field(
        None,
        description="With battery and recorder: the unit in which worth is counted, rounded up.",
    )
    amount: float | None = Field(None, description="What `refutation` shows to be out of reach.")
    refutation: RefutationOut | None = None
    log: str | None = Field(None, description="Of the solver that has proven it, where one has.")
    on_board: float | None = Field(
        None,
        description="What of the value is the most that images can earn which were on board at "
        "the start; the proof is of the rest.",
    )
