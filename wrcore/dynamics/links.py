"""Which bodies and internal states a motion acts on at once: the places where a Jacobian can differ from zero."""

import numpy as np

from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.drive import drive_links, drive_state_bodies
from wrcore.dynamics.flexible_track import track_places
from wrcore.dynamics.marker import FRAME
from wrcore.elements.law import INNER


def packed(lists):
    """Lists of numbers one behind the other: where each starts, and all numbers."""
    starts = np.cumsum([0] + [len(numbers) for numbers in lists])
    return starts, np.array([number for numbers in lists for number in numbers], np.int64)


def joined_sets(model):
    """For each body the set of bodies joined to it, which accelerate together with it."""
    joined = [{body} for body in range(len(model.bodies.mass))]
    for i, j in model.joints.bodies:
        if i != FRAME and j != FRAME:
            joined[i] |= joined[j]
            for body in joined[i]:
                joined[body] = joined[i]
    return joined


def reached_bodies(model):
    """For each body the set of bodies whose accelerations depend on its motion."""
    joined, linked = joined_sets(model), [{body} for body in range(len(model.bodies.mass))]
    for i, j in [*model.elements.pairs, *model.joints.bodies, *drive_links(model)]:
        if i != FRAME and j != FRAME:
            linked[i].add(int(j))
            linked[j].add(int(i))
    return [set().union(*(joined[other] for other in others)) for others in linked]


def internal_state_bodies(model):
    """For each internal state the set of bodies whose accelerations it enters or follows."""
    elements, joined = model.elements, joined_sets(model)
    bodies = [set() for _ in range(elements.states)]
    for p, ends in enumerate(elements.pairs):
        for k in range(elements.first_directed[p], elements.first_directed[p + 1]):
            if elements.law[k, INNER] >= 0:
                bodies[elements.law[k, INNER]] = set().union(*(joined[b] for b in ends if b != FRAME))
    for wheelset, state in model.bodies.independent:
        bodies[state] = joined[model.bodies.wheelsets[wheelset]]
    for wheelset, states in enumerate(internal_state_groups(model)):
        for state in states:
            bodies[state] = joined[model.bodies.wheelsets[wheelset]]
    return bodies + [set().union(*(joined[b] for b in ends)) for ends in drive_state_bodies(model)]


def internal_state_groups(model):
    """For each wheelset the list of internal states that act on one another, those of a flexible track; else none."""
    if not len(model.flexible_track.mass):
        return []
    groups = [[int(state) for state in row] for row in track_places(model) - STATE_SIZE * len(model.bodies.mass)]
    for wheelset, state in model.bodies.independent:
        groups[wheelset].append(int(state))
    return groups
