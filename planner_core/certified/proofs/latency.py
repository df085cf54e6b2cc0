r"""An upper bound if images are worth less the later they come down: multipliers of contacts.

Each target has a multiplier :math:`\lambda_i`, and each contact :math:`c` one for the volume that
it takes down, :math:`\mu_c`. The bits of an image come down in contacts after it that the plan
takes, and none before the contact is ready. So an image that takes :math:`s_k` of the recorder is
worth at most what it is worth on board plus what the best of its contacts adds,

.. math::

    w_k = a v_k + \max_c \; (v_k (1 - a) \, 2^{-(t_c - e_k) / h} - \mu_c s_k)^+ ,

and a contact that is taken earns :math:`\mu_c` times what it can take down. No plan earns more
than :math:`\sum_i \lambda_i` plus, for each satellite, the most that a path under its battery
gains by :math:`(w_k - \lambda_i)^+` and by contacts. An image may use the contact that the path
takes next and all later ones, taken or not (``planner_core.certified.dp.contact_layers``). If
satellites want an antenna at the same time, contacts pay for it, as in ``resource_bound``. Left out
are the order in which bits come down and what telemetry takes of a contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.contact_layers import Layers, layers_of, most_by_contacts
from planner_core.certified.dp.contact_pairs import most_by_pairs
from planner_core.certified.dp.energy_labels import (
    EnergyLevels,
    levels_of_estimate,
    levels_of_proof,
)
from planner_core.certified.dp.queue_tables import Fixing
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.certified.signs import NEVER
from planner_core.certified.tolerances import DOWN, DOWN_S
from planner_core.certified.tuning import TUNING
from planner_core.jit import kernel
from planner_core.precedence.antennas import antenna_charges, paid_for_antennas
from planner_core.precedence.relation import is_transitive_on
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)
from planner_core.worth import surplus


@bundle
class _Terms(NamedTuple):
    """What images and contacts of a satellite are worth.

    Attributes
    ----------
    end_s, on_board, most, size
        Of each task: when it ends, what it earns on board, the most it earns, and its data as a
        share of the recorder. Shape ``(m,)``.
    ready_s, volume
        Of each contact: from when it takes down data, and how much, as a share of the recorder.
        Shape ``(num_contacts,)``.
    decaying
        What an image earns in addition if it comes down at once. Shape ``(m,)``.
    """

    end_s: Floats
    on_board: Floats
    decaying: Floats
    most: Floats
    size: Floats
    ready_s: Floats
    volume: Floats
    half_life_s: float


class ContactCharges(NamedTuple):
    """Multipliers of some contacts; shape ``(num_contacts,)``.

    Attributes
    ----------
    by_volume
        What images pay to come down in each contact, and what it earns for all it can take.
    antenna
        What each contact pays for its antenna.
    """

    by_volume: Floats
    antenna: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LatencyRelaxation:
    """One satellite's programme.

    Attributes
    ----------
    target
        The target of each task; ``num_targets`` for contacts. Shape ``(m,)``.
    contacts
        Rows of the problem's table. Shape ``(num_contacts,)``.
    typical
        Median share of the recorder that an image takes; 1 if that is nothing.
    may_need_all
        Whether a path may need tasks that are worth nothing.
    """

    rows: Ints
    target: Ints
    contacts: Ints
    typical: float
    may_need_all: bool
    network: Network
    levels: EnergyLevels
    layers: Layers
    terms: _Terms

    @classmethod
    def of(
        cls,
        problem: Problem,
        satellite: SatelliteProblem,
        per_collect: int,
        *,
        is_estimate: bool,
        exact: Bools | None = None,
    ) -> LatencyRelaxation:
        """Return the relaxation of a satellite that has opportunities.

        Parameters
        ----------
        exact
            Opportunities whose energy a proof does not round. Shape ``(n,)``.
        """
        network, rows = network_of(problem, satellite), satellite.rows
        layers = layers_of(network)
        is_image = satellite.kind == COLLECT
        own = satellite.resources
        size = np.where(is_image, satellite.end_s - satellite.start_s, 0.0) * own.collect_fill_per_s
        on_board = problem.objective.collected_share * problem.worth_on_ground[rows]
        setup_s = problem.downlinks.stations.setup_s[satellite.site[layers.contact]]
        if is_estimate:
            levels = levels_of_estimate(network, per_collect)
        else:
            levels = levels_of_proof(network, per_collect, None if exact is None else exact[rows])
        # With transitivity a worthless task then gains a path nothing, neither energy nor a turn.
        is_dear = own.sun_pointing == "free" and own.idle_drain_per_s == 0.0
        return cls(
            rows=rows,
            target=np.where(is_image, satellite.site, len(problem.target_ids)).astype(np.int32),
            contacts=rows[layers.contact],
            typical=(float(np.median(size[is_image])) if is_image.any() else 0.0) or 1.0,
            may_need_all=not (is_dear and is_transitive_on(satellite)),
            network=network,
            levels=levels,
            layers=layers,
            terms=_Terms(
                end_s=satellite.end_s,
                on_board=on_board,
                decaying=problem.worth_on_ground[rows] - on_board,
                most=problem.worth[rows],
                size=np.maximum(size - DOWN, 0.0),
                ready_s=satellite.start_s[layers.contact] + setup_s - DOWN_S,
                volume=satellite.volume[layers.contact],
                half_life_s=problem.objective.half_life_s or np.inf,
            ),
        )

    def most(self, multipliers: Floats, charges: ContactCharges) -> tuple[float, Ints, Ints]:
        """Return the most that the satellite can gain, a path that gains it, and its layers.

        Parameters
        ----------
        multipliers
            Of targets, and a 0 for contacts. Shape ``(num_targets + 1,)``.
        charges
            Of the satellite's contacts.
        """
        m, weight = len(self.rows), self._weight(multipliers, charges)
        own, num_own = np.empty((m, self.levels.width)), np.zeros(m, dtype=np.int64)
        return most_by_contacts(self.network, self.levels, self.layers, weight, own, num_own)

    def most_by_pairs(
        self, multipliers: Floats, charges: ContactCharges
    ) -> tuple[Floats, Fixing] | None:
        """Return the most that it can gain with each pair of contacts directly after each other.

        See ``contact_pairs.most_by_pairs``. Also returns what tells which states the programme over
        queues may leave out. None if contacts share layers. Shape
        ``(num_contacts + 1, num_contacts + 1)``.
        """
        if len(self.layers.first) <= len(self.contacts):
            return None
        weight = self._weight(multipliers, charges)
        most, after = most_by_pairs(self.network, self.levels, self.layers, weight)
        fixing = Fixing(
            layers=self.layers,
            weight=weight,
            charge=charges.by_volume,
            after_contact=after,
            least=-np.inf,
        )
        return most, fixing

    def _weight(self, multipliers: Floats, charges: ContactCharges) -> Floats:
        weight = np.empty((len(self.layers.first), len(self.rows)))
        passed = 0.0 if self.may_need_all else NEVER
        earned = charges.by_volume * self.terms.volume - charges.antenna
        _weigh(
            self.terms,
            self.layers,
            multipliers[self.target],
            charges.by_volume,
            earned,
            passed,
            weight,
        )
        return weight

    def loads(self, path: Ints, layer: Ints, charges: ContactCharges) -> Floats:
        """Return how much more data than it can take down a path gives to each contact.

        Parameters
        ----------
        path, layer
            As returned by ``most``.

        Returns
        -------
        Shape ``(num_contacts,)``.
        """
        load = np.zeros(len(self.contacts))
        number = self.layers.number[path]
        taken = number[number >= 0]
        load[taken] -= self.terms.volume[taken]
        if len(load) == 0:
            return load
        t, images, own = self.terms, path[number < 0], layer[number < 0]
        age_s = np.maximum(t.ready_s[None, :] - t.end_s[images, None], 0.0)
        gain = t.decaying[images, None] * np.exp2(-age_s / t.half_life_s)
        gain = np.minimum(gain, (t.most - t.on_board)[images, None])
        gain -= charges.by_volume[None, :] * t.size[images, None]
        may_follow = self.layers.contact[None, :] > images[:, None]
        may_follow &= np.arange(len(load))[None, :] >= self.layers.first[own, None]
        gain[~may_follow] = -np.inf
        best = gain.argmax(axis=1)
        is_down = gain[np.arange(len(images)), best] > 0.0
        np.add.at(load, best[is_down], t.size[images[is_down]])
        return load


@kernel
def _weigh(
    terms: _Terms,
    layers: Layers,
    multiplier: Floats,
    charges: Floats,
    earned: Floats,
    passed: float,
    weight: Floats,
) -> None:
    """Fill in what each task is worth in each layer; ``passed`` if that is nothing.

    Parameters
    ----------
    charges
        What images pay to each contact, by volume. Shape ``(num_contacts,)``.
    earned
        What each contact earns if it is taken. Shape ``(num_contacts,)``.
    """
    num_layers, m = weight.shape
    gain = np.zeros(m)
    for layer in range(num_layers - 1, -1, -1):
        if layer < num_layers - 1:
            for c in range(layers.first[layer], layers.first[layer + 1]):
                for k in range(layers.contact[c]):
                    age_s = max(terms.ready_s[c] - terms.end_s[k], 0.0)
                    worth = terms.decaying[k] * 2.0 ** (-age_s / terms.half_life_s)
                    worth = min(worth, terms.most[k] - terms.on_board[k])
                    gain[k] = max(gain[k], worth - charges[c] * terms.size[k])
        for k in range(m):
            worth = terms.on_board[k] + gain[k] - multiplier[k]
            weight[layer, k] = worth if worth > 0.0 else passed
        if layer < num_layers - 1:
            for c in range(layers.first[layer], layers.first[layer + 1]):
                weight[layer, layers.contact[c]] = earned[c]


def latency_relaxations(
    problem: Problem,
    *,
    is_estimate: bool = False,
    per_collect: int | None = None,
    exact: Bools | None = None,
) -> tuple[LatencyRelaxation, ...]:
    """Return the programmes of all satellites that have opportunities.

    Parameters
    ----------
    is_estimate
        Whether rounding energy may lose plans: enough for a search for multipliers.
    per_collect
        How many levels of energy a collect takes; by default ``TUNING.levels_per_collect``.
    exact
        Opportunities whose energy a proof does not round, none by default. Shape ``(n,)``.
    """
    levels = TUNING.levels_per_collect if per_collect is None else per_collect
    return tuple(
        LatencyRelaxation.of(problem, satellite, levels, is_estimate=is_estimate, exact=exact)
        for satellite in problem.satellites
        if len(satellite)
    )


def latency_value(
    problem: Problem,
    multipliers: Floats,
    contact_multipliers: Floats,
    antenna_multipliers: Floats | None = None,
) -> float:
    """Return the bound that multipliers of targets, of contacts and of antennas prove.

    This is the whole proof: it needs no search, only the problem.

    Parameters
    ----------
    multipliers
        Shape ``(num_targets,)``.
    contact_multipliers
        By volume, of the table's contacts in order. Shape ``(num_contacts,)``.
    antenna_multipliers
        Of ``antenna_groups``; 0 by default. Shape ``(num_groups,)``.
    """
    given = LatencyMultipliers.of(problem, multipliers, contact_multipliers, antenna_multipliers)
    relaxations = latency_relaxations(problem)
    gained = (one.most(given.targets, given.tolls_of(one))[0] for one in relaxations)
    return given.paid + sum(gained)


class LatencyMultipliers(NamedTuple):
    """Multipliers as the programmes take them.

    Attributes
    ----------
    targets
        With a 0 at the end. Shape ``(num_targets + 1,)``.
    by_volume, antenna
        Multipliers of each opportunity that is a contact; 0 for others. Shape ``(n,)``.
    paid
        The bound's constant: multipliers of targets, and of antennas times their limits.
    """

    targets: Floats
    by_volume: Floats
    antenna: Floats
    paid: float

    @classmethod
    def of(
        cls, problem: Problem, targets: Floats, contacts: Floats, antennas: Floats | None
    ) -> LatencyMultipliers:
        """Return these multipliers; those of contacts and antennas are as in ``latency_value``."""
        multiplier = np.append(surplus(targets, problem.best_worth), 0.0)
        by_volume = np.zeros(len(problem.opportunities))
        by_volume[problem.opportunities.kind == CONTACT] = np.maximum(contacts, 0.0)
        return cls(
            targets=multiplier,
            by_volume=by_volume,
            antenna=antenna_charges(problem, antennas),
            paid=float(multiplier.sum()) + paid_for_antennas(problem, antennas),
        )

    def tolls_of(self, one: LatencyRelaxation) -> ContactCharges:
        """Return the multipliers of a satellite's contacts."""
        return ContactCharges(self.by_volume[one.contacts], self.antenna[one.contacts])
