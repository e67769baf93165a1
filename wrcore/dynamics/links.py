"""Which bodies and own states a motion acts on at once: the places where a Jacobian can differ from zero."""

from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.drive import drive_links, drive_state_bodies
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.support import support_places


def _links(model):
    """For each body the set of bodies joined to it, and the set of those whose accelerations depend on its motion."""
    n = len(model.bodies.mass)
    joined, linked = [{b} for b in range(n)], [{b} for b in range(n)]
    for i, j in model.joints.bodies:
        if i != FRAME and j != FRAME:  # bodies joined to one another accelerate together
            joined[i] |= joined[j]
            for body in joined[i]:
                joined[body] = joined[i]
    for i, j in [*model.elements.pairs, *model.joints.bodies, *drive_links(model)]:
        if i != FRAME and j != FRAME:
            linked[i].add(int(j))
            linked[j].add(int(i))
    return joined, [set().union(*(joined[k] for k in linked[body])) for body in range(n)]


def joined_sets(model):
    """For each body the set of bodies joined to it, which accelerate together with it."""
    return _links(model)[0]


def reached_bodies(model):
    """For each body the set of bodies whose accelerations depend on its motion."""
    return _links(model)[1]


def own_state_bodies(model):
    """For each own state the set of bodies whose accelerations it enters or follows."""
    elements, joined = model.elements, _links(model)[0]
    bodies = [set() for _ in range(elements.states)]
    for p, ends in enumerate(elements.pairs):
        for k in range(elements.first_directed[p], elements.first_directed[p + 1]):
            if elements.law[k, 4] >= 0:
                bodies[elements.law[k, 4]] = set().union(*(joined[b] for b in ends if b != FRAME))
    for wheelset, state in model.bodies.independent:
        bodies[state] = joined[model.bodies.wheelsets[wheelset]]
    for wheelset, states in enumerate(own_state_groups(model)):
        for state in states:
            bodies[state] = joined[model.bodies.wheelsets[wheelset]]
    return bodies + [set().union(*(joined[b] for b in ends)) for ends in drive_state_bodies(model)]


def own_state_groups(model):
    """For each wheelset the list of own states that act on one another, those of a track that gives; else nothing."""
    if not len(model.support.mass):
        return []
    groups = [[int(state) for state in row] for row in support_places(model) - STATE_SIZE * len(model.bodies.mass)]
    for wheelset, state in model.bodies.independent:
        groups[wheelset].append(int(state))
    return groups
