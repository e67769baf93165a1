"""Friction along one direction that sticks and slips; its limit may increase with the force in another element.

The limit L is a constant force plus mu times the normal force N in another element of the same pair of bodies. There
are two laws, both with a displacement as internal state.

*Slider*: a slider at s and a spring of stiffness c in series have the force f = c (x - s). From the force L - w on, the
slider moves with s' = x' (g - L + w)/w, g = f sign(x'). At g = L it is as fast as x, at any speed. If L decreases below
|f|, the term (|f| - L) sign(f)/(c T) with T = 1 ms is added to s', so that f decreases at rest, too. Both terms
dissipate energy.
*Approach*: Fancher's exponential approach to the limit over a distance b, f = L z/b with z' = x' - |x'| z/b. Without
reversal f - L decreases by the factor 1/e over b, at any speed. At constant L the stored energy is L z^2/(2 b), the
dissipated power L |x'| (z/b)^2. A link of length l that hangs under N adds the force N x/l.

References
----------
Fancher, Ervin, MacAdam, Winkler, Measurement and representation of the mechanical properties of truck leaf springs,
SAE technical paper 800905 (1980): the approach. Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14
(1976) 1675-1682: this law as a differential equation. Iwnicki, Stichel, Orlova, Hecht, Dynamics of railway freight
vehicles, Vehicle System Dynamics 53 (2015) 995-1033: a spring and a slider in series, both laws for leaf springs and
links, friction by the load in Lenoir links and wedges.
"""

import math

from wrcore.forces import law
from wrcore.forces.kind import AT, DIRECTION, MOST, Along, Kind, axis_of, ends_of, number
from wrcore.kernels.jit import FUSED, jit

ROUNDING, FLOOR = 0.02, 1e-3
"""Width w of a slider: `ROUNDING` times the limit, at least `FLOOR` times the larger of nominal limit and 1 N."""

GIVING_WAY = 1e-3
"""Time constant T with which the force of a slider at rest falls to a decreased limit, s."""


@jit(allocates=False, fastmath=FUSED)
def slider(elements, k, stretch, speed, inner, press):
    """Return force, rate of the slider, stored energy and dissipated power of a spring and slider in series."""
    alone, nominal, pushed, pulled, stiffness, _ = law.numbers(elements, k)
    limit = alone + max(pushed * press, -pulled * press)
    force, width = stiffness * (stretch - inner), max(ROUNDING * limit, FLOOR * max(nominal, 1.0))
    along = math.copysign(1.0, speed) * force
    slip = speed * max(along - max(limit - width, 0.0), 0.0) / width
    rate = slip + math.copysign(max(abs(force) - limit, 0.0), force) / (GIVING_WAY * stiffness)
    return force, rate, 0.5 * stiffness * (stretch - inner) ** 2, force * rate


@jit(allocates=False, fastmath=FUSED)
def approach(elements, k, stretch, speed, inner, press):
    """Return force, state rate, stored energy and dissipated power of the exponential approach law.

    The stored energy is that at the nominal limit; the work of a varying limit counts as dissipated."""
    alone, nominal, pushed, pulled, distance, hanging = law.numbers(elements, k)
    limit = alone + max(pushed * press, -pulled * press)
    force, rate = limit * (inner / distance + hanging * stretch), speed - abs(speed) * inner / distance
    stored = 0.5 * nominal * (inner * inner / distance + hanging * (stretch * stretch))
    storing = nominal * (inner * rate / distance + hanging * (stretch * speed))
    return force, rate, stored, force * speed - storing


def parts(item):
    """Return one part with the law `approach` or `slider`."""
    mu, alone, slip = item.get("mu", 0.0), item.get("force", 0.0), (item.get("series_stiffness"), 0.0)
    if "approach" in item:
        slip = item["approach"], 1.0 / (mu * item["pendulum"]) if "pendulum" in item else 0.0

    def numbers(press):
        return alone, alone + mu * abs(press), mu * (press >= 0.0), mu * (press <= 0.0), *slip

    held_by = approach if "approach" in item else slider
    return [Along(ends_of(item), held_by, axis_of(item), numbers, inner=True, normal=item.get("normal"))]


def check(item):
    """Check that the limit is given, by force or by mu and normal, and the data of one of the two laws."""
    if ("mu" in item) != ("normal" in item):
        yield "", "expected both mu and normal, the name of the element that presses, or neither"
    if "force" not in item and "mu" not in item:
        yield "force", "expected a value, or mu and normal"
    if "series_stiffness" not in item and "approach" not in item:
        yield "series_stiffness", "expected a value, as kind friction needs one, or approach"
    if "series_stiffness" in item and "approach" in item:
        yield "approach", "expected either approach or series_stiffness"
    if "pendulum" in item and ("approach" not in item or "mu" not in item or "force" in item):
        yield "pendulum", "expected mu, normal and approach with it, and no force"


KIND = Kind(
    {
        "at": AT,
        "direction": DIRECTION,
        "force": number("the force in N at which friction gives way, above 0 (1e-6 to 1e15)", 1e-6),
        "mu": number("the coefficient that the force in the element 'normal' is multiplied by (1e-6 to 10)", 1e-6, 10.0,
                     **{"x-unit": "1"}),
        "normal": {"type": "string", "description": "the element between the same two bodies whose force presses"},
        "series_stiffness": {"type": "number", "exclusiveMinimum": 0.0, "maximum": MOST,
                             "description": "the stiffness in N/m while it sticks, above 0"},
        "approach": number("the distance in m over which friction approaches its limit, 1e-6 to 1", 1e-6, 1.0),
        "pendulum": number("the length in m of a link that hangs under the force in 'normal', 0.001 to 100", 1e-3, 100),
    },
    ("at", "direction"), {"marker": "^", "color": "#E69F00"}, parts, check, (slider, approach),
)  # fmt: skip
