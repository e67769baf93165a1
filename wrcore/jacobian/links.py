"""Coupling of bodies and internal states: the structure of the Jacobian's nonzero entries."""

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.marker import FRAME
from wrcore.forces.control import control_links
from wrcore.forces.drive import BRAKE, CONTROLLED, KIND, NUMBER, REACTION, WHEEL, drive_links, drive_state_bodies
from wrcore.forces.law import INNER, LAW, NUMBERS
from wrcore.track.flexible_track import RAILS, track_places


def packed(lists):
    """Concatenate lists of numbers; return where each list starts (one more entry than lists), and all numbers."""
    starts = np.cumsum([0] + [len(numbers) for numbers in lists])
    return starts, np.array([number for numbers in lists for number in numbers], np.int64)


def joined_sets(model):
    """Return for each body the set of bodies that joints connect to it, which accelerate together with it."""
    joined = [{body} for body in range(len(model.bodies.mass))]
    for i, j in model.joints.bodies:
        if i != FRAME and j != FRAME:
            joined[i] |= joined[j]
            for body in joined[i]:
                joined[body] = joined[i]
    return joined


def reached_bodies(model):
    """Return for each body the set of bodies whose accelerations depend on its motion."""
    joined, linked = joined_sets(model), [{body} for body in range(len(model.bodies.mass))]
    for i, j in [*model.elements.pairs, *model.joints.bodies, *drive_links(model)]:
        if i != FRAME and j != FRAME:
            linked[i].add(int(j))
            linked[j].add(int(i))
    for bodies, _ in control_links(model):
        for body in bodies:
            linked[body] |= bodies
    return [set().union(*(joined[other] for other in others)) for others in linked]


def internal_state_bodies(model):
    """Return for each internal state the set of bodies that it is coupled to, by its effect or by its rate."""
    elements, joined = model.elements, joined_sets(model)
    bodies = [set() for _ in range(elements.states)]
    for p, ends in enumerate(elements.pairs):
        for k in range(elements.first_directed[p], elements.first_directed[p + 1]):
            for state in _states_of(elements, k):
                bodies[state] = set().union(*(joined[b] for b in ends if b != FRAME))
    for wheelset, state in model.bodies.independent:
        bodies[state] = joined[model.bodies.wheelsets[wheelset]]
    for wheelset, states in enumerate(_track_groups(model)):
        for state in states:
            bodies[state] = joined[model.bodies.wheelsets[wheelset]]
    bodies += [set().union(*(joined[b] for b in ends)) for ends in drive_state_bodies(model)]
    bodies += [set() for _ in model.controls.start]
    for ends, states in [*control_links(model), *_independently_driven_wheels(model)]:
        for state in states:
            bodies[state] = bodies[state].union(*(joined[b] for b in ends))
    for states in internal_state_groups(model):
        together = set().union(*(bodies[state] for state in states))
        for state in states:
            bodies[state] = together
    return bodies


def _states_of(elements, k):
    """Return the indices of the internal states of the k-th element along one direction."""
    first, own = int(elements.law[k, INNER]), elements.law[k, LAW] < 0
    return range(first, first + (int(elements.directed[k, NUMBERS]) if own else 1)) if first >= 0 else ()


def _independently_driven_wheels(model):
    """Yield bodies and internal states coupled by each motor or brake of a single wheel with motion-dependent torque.

    The states are that of the wheels, and that of the speed controller if it controls the motor."""
    independent = {int(wheelset): int(state) for wheelset, state in model.bodies.independent}
    for row in model.drive.rows:
        if row[WHEEL] and row[KIND] in (BRAKE, CONTROLLED):
            followed = {int(body) for body in model.drive.control[:, 0]} if row[KIND] == CONTROLLED else set()
            states = {independent[int(row[NUMBER])]} | ({model.elements.states} if row[KIND] == CONTROLLED else set())
            yield followed | {int(row[REACTION])} - {FRAME}, states


def _track_groups(model):
    """Return for each wheelset the list of internal states of the track under it; empty for rigid track."""
    if not len(model.flexible_track.mass):
        return []
    return [[int(state) for state in row] for row in track_places(model) - STATE_SIZE * len(model.bodies.mass)]


def contact_places(model):
    """Return the Jacobian's columns (k, c) and rows of rates (k, r) that contain contact forces of each wheelset.

    Numbers are those of `wrcore.jacobian.jacobian.Sweep`; negative: none. Columns are the wheelset's displacements and
    velocities, then displacements of its rails, their velocities if they have mass, and half the difference of rolling
    rates of independently rotating wheels. Rows are the rates of the rails' velocities (of displacements for massless
    rails), and of this difference."""
    n, wheelsets, apart = len(model.bodies.mass), model.bodies.wheelsets, dict(model.bodies.independent.tolist())
    groups, freedoms, columns, rows = _track_groups(model), len(model.flexible_track.mass), [], []
    for k, body in enumerate(wheelsets):
        rails, speeds = (groups[k][:RAILS], groups[k][freedoms:][:RAILS]) if groups else ([], [])
        own = [apart.get(k, -1 - 12 * n)] if apart else []
        columns.append([*range(6 * body, 6 * body + 6), *range(6 * (n + body), 6 * (n + body) + 6),
                        *(12 * n + state for state in [*rails, *speeds, *own])])  # fmt: skip
        rows.append([6 * n + state for state in [*(speeds or rails), *own]])
    if not columns:
        return np.zeros((0, 12), int), np.zeros((0, 0), int)
    return np.array(columns), np.maximum(np.array(rows, int), -1)


def track_displacements(model):
    """Return a dictionary from each internal state that is a velocity of the track to that of its displacement."""
    freedoms = len(model.flexible_track.mass)
    return {v: q for states in _track_groups(model) for q, v in zip(states, states[freedoms:], strict=False)}


def internal_state_groups(model):
    """Return lists of internal states that act on one another: of flexible track, of user's laws, of control laws."""
    groups = _track_groups(model)
    for wheelset, state in model.bodies.independent if groups else ():
        groups[wheelset].append(int(state))
    elements = [list(_states_of(model.elements, k)) for k in range(len(model.elements.law))]
    more = [*elements, *(sorted(states) for _, states in [*control_links(model), *_independently_driven_wheels(model)])]
    for states in more:
        if len(states) > 1:
            shared = [group for group in groups if set(group) & set(states)]
            groups = [group for group in groups if group not in shared]
            groups.append(sorted(set(states).union(*shared)))
    return groups
