"""The ascent on multipliers of contacts, if images are worth less the later they come down.

Contacts are few, an answer takes hundredths of a second, and the search for plans needs to know
which contacts the relaxed plans take. So every satellite answers in each round, and multipliers of
targets and contacts move together, in proportion to the gap between bound and best plan (Polyak's
step); steps get shorter once the bound no longer falls.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.latency import ContactCharges, latency_relaxations, latency_value
from planner_core.certified.tolerances import SAME
from planner_core.certified.tuning import TUNING
from planner_core.precedence.antennas import (
    antenna_charges,
    antenna_groups,
    paid_for_antennas,
)
from planner_core.problem import CONTACT, Bytes, Floats, Problem


class LatencyAscent:
    """Multipliers of targets and contacts that get better round by round.

    Parameters
    ----------
    begin
        The initial multipliers of targets, unless multipliers of zero prove a lower bound: if
        energy is short, few targets are taken twice. Shape ``(num_targets,)``.

    Attributes
    ----------
    value
        The lowest value so far; an estimate if satellites turn to the sun.
    contact_sets
        The contacts of each round's answers, rows ascending; each set once, the latest last.
    """

    def __init__(self, problem: Problem, begin: Floats) -> None:
        self._problem = problem
        self._satellites = latency_relaxations(problem, is_estimate=True)
        self._most = np.append(problem.best_worth, 0.0)
        self._is_contact = problem.opportunities.kind == CONTACT
        self._multipliers = np.zeros(len(begin) + 1)
        # Of each opportunity, for a typical image's data; 0 for collects.
        self._charges = np.zeros(len(problem.opportunities))
        self._groups = antenna_groups(problem)
        self._antenna = np.zeros(len(self._groups))
        self._images_per_contact = self._images_that_contacts_take()
        self._best = self._multipliers, self._charges, self._antenna
        self._length, self._num_idle = 1.0, 0
        self.contact_sets: dict[tuple[int, ...], None] = {}
        self.value = float(problem.best_worth.sum())
        self._proven = Bound(value=self.value, proof="lagrangian", multipliers=problem.best_worth)
        self._at_proof = self.value
        given = np.append(begin, 0.0)
        if self._value(given) < self._value(self._multipliers):
            self._multipliers = given

    @property
    def is_settled(self) -> bool:
        """Whether more rounds are of little use."""
        return self._length < TUNING.little

    def improve(self, num_rounds: int, level: float, stop: Bytes) -> None:
        """Run some rounds towards a bound of ``level``, which a known plan earns."""
        for _ in range(num_rounds):
            if stop[0] or self.is_settled or self.value <= level:
                return
            self._go_round(level, stop)

    @property
    def multipliers(self) -> Floats:
        """The best multipliers of targets. Shape ``(num_targets,)``."""
        multipliers, _, _ = self._best
        return multipliers[:-1]

    @property
    def contact_multipliers(self) -> Floats:
        """The best multipliers of contacts, by volume. Shape ``(num_contacts,)``."""
        _, charges, _ = self._best
        charges = charges.copy()
        for one in self._satellites:
            charges[one.contacts] /= one.typical
        by_volume: Floats = charges[self._is_contact]
        return by_volume

    @property
    def antenna_multipliers(self) -> Floats | None:
        """The best multipliers of antennas; None if all are 0. Shape ``(num_groups,)``."""
        _, _, antenna = self._best
        return antenna if antenna.any() else None

    def bound(self, *, is_last: bool = True) -> Bound:
        """Return the lowest bound proven so far.

        With turns to the sun a proof takes as long as several rounds. Unless ``is_last``, it is
        made only once the estimate has fallen by ``TUNING.worth_a_step``.
        """
        step = 0.0 if is_last else TUNING.worth_a_step * self._at_proof
        if self.value < self._at_proof - step:
            self._at_proof = value = self.value
            if self._problem.turns_to_the_sun:
                value = latency_value(
                    self._problem,
                    self.multipliers,
                    self.contact_multipliers,
                    self.antenna_multipliers,
                )
            if value < self._proven.value:
                self._proven = Bound(
                    value=value,
                    proof="dp",
                    multipliers=self.multipliers,
                    contact_multipliers=self.contact_multipliers,
                    antenna_multipliers=self.antenna_multipliers,
                )
        return self._proven

    def _value(self, multipliers: Floats) -> float:
        """Return the value at these multipliers of targets, without those of contacts."""
        value = float(multipliers.sum())
        for one in self._satellites:
            free = np.zeros(len(one.contacts))
            value += one.most(multipliers, ContactCharges(free, free))[0]
        return value

    def _images_that_contacts_take(self) -> float:
        volumes = [one.terms.volume / one.typical for one in self._satellites]
        return float(np.mean(np.maximum(np.concatenate([*volumes, np.ones(1)]), 1.0)))

    def _go_round(self, level: float, stop: Bytes) -> None:
        value = float(self._multipliers.sum()) + paid_for_antennas(self._problem, self._antenna)
        antenna = antenna_charges(self._problem, self._antenna)
        too_many = np.append(-np.ones(len(self._most) - 1), 0.0)
        too_much = np.zeros(len(self._charges))
        is_taken = np.zeros(len(self._charges), dtype=np.bool_)
        for one in self._satellites:
            if stop[0]:
                return
            charges = ContactCharges(
                self._charges[one.contacts] / one.typical, antenna[one.contacts]
            )
            gained, path, layer = one.most(self._multipliers, charges)
            value += gained
            np.add.at(too_many, one.target[path], 1.0)
            too_much[one.contacts] = one.loads(path, layer, charges) / one.typical
            is_taken[one.rows[path[one.layers.number[path] >= 0]]] = True
        too_many[-1] = 0.0
        contacts = tuple(np.flatnonzero(is_taken).tolist())
        self.contact_sets.pop(contacts, None)
        self.contact_sets[contacts] = None
        if self._is_hopeful(value):
            excess = np.array([is_taken[g.rows].sum() - g.limit for g in self._groups])
            self._move(value - level, too_many, too_much, self._images_per_contact * excess)

    def _is_hopeful(self, value: float) -> bool:
        """Note the current value; return False if it leads back to the best multipliers."""
        if value < self.value * (1.0 - SAME):
            self._best, self._num_idle = (self._multipliers, self._charges, self._antenna), 0
            self.value = value
            return True
        self._num_idle += 1
        if self._num_idle < TUNING.patience:
            return True
        self._length, self._num_idle = TUNING.shorter * self._length, 0
        self._multipliers, self._charges, self._antenna = self._best
        return False

    def _move(self, above: float, too_many: Floats, too_much: Floats, excess: Floats) -> None:
        """Raise multipliers of what the answers take too much of, and lower the others.

        Parameters
        ----------
        excess
            Of each group of contacts, in images that they can bring down. Shape ``(num_groups,)``.
        """
        too_many = np.where((self._multipliers <= 0.0) & (too_many < 0.0), 0.0, too_many)
        too_much = np.where((self._charges <= 0.0) & (too_much < 0.0), 0.0, too_much)
        excess = np.where((self._antenna <= 0.0) & (excess < 0.0), 0.0, excess)
        squares = sum(float(np.square(each).sum()) for each in (too_many, too_much, excess))
        above = min(above, TUNING.far_above * self.value)
        step = self._length * above / squares if squares > 0.0 else 0.0
        self._multipliers = np.clip(self._multipliers + step * too_many, 0.0, self._most)
        self._charges = np.maximum(self._charges + step * too_much, 0.0)
        self._antenna = np.maximum(self._antenna + step * self._images_per_contact * excess, 0.0)
