"""Results of one simulation: channels by group, how it ended, its counters and settings; tables and plots of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

import wrcore
from wrcore.errors import InputError, UnknownNameError, similar
from wrcore.errors.checked_calls import checked
from wrcore.run.output.channels import DESCRIPTIONS, unit_of
from wrcore.run.output.derived import derived_channels

if TYPE_CHECKING:
    import pandas as pd
    import xarray
    from matplotlib.figure import Figure

    from wrcore.integrate.trajectory import Checkpoint


class Channels(Mapping[str, np.ndarray]):
    """Channels of one group, as attributes and as items; ``dir`` and completion list them.

    Channels of ``derived`` are computed on access. Iteration, length and ``in`` cover only the channels that are stored
    in the run.

    Examples
    --------
    >>> import numpy as np
    >>> wheelset = Channels("wheelset", {"y_m": np.zeros(3)})
    >>> wheelset.y_m is wheelset["y_m"], list(wheelset)
    (True, ['y_m'])
    """

    def __init__(
        self,
        group: str,
        channels: Mapping[str, np.ndarray],
        derived: Mapping[str, Callable[[], np.ndarray]] | None = None,
    ) -> None:
        self._group, self._channels, self._derived = group, channels, derived or {}

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self._channels:
            return self._channels[name]
        if name in self._derived:
            return self._derived[name]()
        has, known = ", ".join(self._channels), self.names()
        follow = f", and what follows from these, {', '.join(self._derived)}" if self._derived else ""
        text = f"no channel {name!r} in {self._group!r}; it has {has}{follow}{similar(name, known)}"
        raise UnknownNameError("run", "", text)

    def __contains__(self, name: object) -> bool:
        return name in self._channels

    def follows(self, name: str) -> bool:
        """Whether a channel is stored, or can be derived from the stored channels."""
        return name in self._channels or name in self._derived

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_"):  # copying and pickling access such names before the channels exist
            raise AttributeError(name)
        try:
            return self[name]
        except UnknownNameError as error:
            raise AttributeError(error.expected) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def names(self) -> list[str]:
        """Return the names of the stored channels, then those of the derived channels."""
        return [*self._channels, *self._derived]

    def __dir__(self) -> list[str]:
        return sorted([*super().__dir__(), *self.names()])

    _ipython_key_completions_ = names

    def __repr__(self) -> str:
        width = max(map(len, self._channels), default=0)
        rows = [
            f"  {name:{width}}  {unit_of(name):7} {np.shape(values)}  {DESCRIPTIONS.get(name, '')}".rstrip()
            for name, values in self._channels.items()
        ]
        return "\n".join([f"{self._group}:", *rows])


@dataclass(repr=False)
class Run:
    """Results of one simulated scene: channels over time, how the run ended, counters and settings.

    Parameters
    ----------
    scene : dict
        The resolved scene, made of plain JSON values.
    status : str
        ``completed``, ``derailed``, ``stalled`` or ``failed``.
    reason : str
        One line on why the run ended; empty for a completed run.
    t : ndarray, shape (n,)
        Output times, s.
    groups : dict of str to dict of str to ndarray
        Channels by group. A body's group (``wheelset``) holds arrays of shape (n,), in the axes of the track at the
        position of the body (:mod:`wrcore.run.output.channels`). A wheel's group (``wheelset/left``) holds arrays of
        shape (n, patches), NaN where a patch is absent. The group ``energy``, if requested, holds energies and powers
        of the whole model. Names contain the unit.
    counters : dict
        Plain numbers: steps, rejected, rhs_evaluations, jacobians, factorisations, wall_s, compile_s and others.
    settings : dict
        Flat record of the numerical choices, with the package version.
    end : Checkpoint or None
        End of a run of the compiled integrator, from which another run can continue.
    end_t : float
        Time of the last valid state, s: the end of a completed run, else the last accepted step before the run ended.
    end_state : State, shape (size,), or None
        The last valid state: 13 numbers per body (position, Euler parameters, velocity, angular velocity), then the
        states of force elements. The array has its time, the position of the moving frame and the names of the vehicle
        as attributes (:mod:`wrcore.run.state`). :func:`wrcore.run.simulate` takes it as a start.

    Examples
    --------
    ``run["wheelset"].y_m`` is the lateral position in m, ``run["wheelset/left"].N_N`` the normal forces in N,
    ``run["wheelset/left"].Y_N`` the lateral force on the rail, which is derived from the contacts' channels
    (:mod:`wrcore.run.output.derived`).

    >>> import numpy as np
    >>> run = Run({"name": "still"}, "completed", "", np.array([0.0, 0.5]), {"wheelset": {"y_m": np.zeros(2)}})
    >>> run
    Run 'still': completed, 0.5 s, 2 output times; groups: wheelset
    >>> run["wheelset"].y_m.max()
    np.float64(0.0)
    >>> run.to_pandas()["wheelset.y_m"].tolist()
    [0.0, 0.0]
    """

    scene: dict[str, Any]
    status: str
    reason: str
    t: np.ndarray
    groups: dict[str, dict[str, np.ndarray]]
    counters: dict[str, Any] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)
    end: Checkpoint | None = None
    end_t: float = float("nan")
    end_state: np.ndarray | None = None

    @checked
    def __getitem__(self, group: str) -> Channels:
        """Return the channels of one group; KeyError names the groups that exist."""
        if group not in self.groups:
            has = f"no group {group!r} in this run; it has {', '.join(sorted(self.groups))}"
            raise UnknownNameError("run", "", f"{has}{similar(group, self)}")
        derived = derived_channels(self.groups, group, self.scene.get("speed", np.nan))
        return Channels(group, self.groups[group], derived)

    def __contains__(self, group: object) -> bool:
        return group in self.groups

    def __iter__(self) -> Iterator[str]:
        return iter(self.groups)

    def __len__(self) -> int:
        return len(self.groups)

    def keys(self) -> list[str]:
        """Return the names of the groups."""
        return list(self.groups)

    def _ipython_key_completions_(self) -> list[str]:
        return self.keys()

    def __repr__(self) -> str:
        reached = f"{self.t[-1] - self.t[0]:g} s, {len(self.t)} output times" if len(self.t) else "nothing simulated"
        cost = f" in {self.counters['wall_s']:.2g} s" if "wall_s" in self.counters else ""
        ended = f"{self.status} ({self.reason})" if self.reason else self.status
        return f"Run {self.scene.get('name', '')!r}: {ended}, {reached}{cost}; groups: {', '.join(self.groups)}"

    @checked
    def to_pandas(self, tidy: bool = False) -> pd.DataFrame:
        """Return all channels as one table.

        Parameters
        ----------
        tidy : bool
            False: a row per output time (index ``t_s``), a column per channel, named ``wheelset.y_m``, and
            ``wheelset/left.N_N.0`` for patch 0 of a wheel. True: a row per value with columns ``t_s``, ``group``,
            ``channel``, ``patch`` (0 except for contacts), ``value`` and ``unit``; absent values are omitted.

        Returns
        -------
        pandas.DataFrame
            Values in SI units, which the names state. Patches that never occur in the run are omitted.
        """
        import pandas as pd

        columns = dict(self.columns())
        wide = {".".join(map(str, (group, name, *patch))): values for (group, name, *patch), values in columns.items()}
        if not tidy:
            return pd.DataFrame(wide, index=pd.Index(self.t, name="t_s"))
        parts = [
            pd.DataFrame({
                "t_s": self.t, "group": group, "channel": name, "patch": patch[0] if patch else 0, "value": values,
                "unit": unit_of(name),
            })
            for (group, name, *patch), values in columns.items()
        ]  # fmt: skip
        return pd.concat(parts, ignore_index=True).dropna(subset="value", ignore_index=True)

    def columns(self) -> Iterator[tuple[tuple[Any, ...], np.ndarray]]:
        """Yield name and values (n,) of each channel, those of contacts patch by patch."""
        for group, channels in self.groups.items():
            for name, values in channels.items():
                if values.ndim == 1:
                    yield (group, name), values
                else:
                    for patch, column in enumerate(values.T):
                        if patch == 0 or not np.isnan(column).all():
                            yield (group, name, patch), column

    def to_xarray(self) -> xarray.DataTree:
        """Return all channels as an xarray tree of data sets (``pip install xarray``).

        Returns
        -------
        xarray.DataTree
            A node per group (``tree["wheelset/left"]``) with a variable per channel over ``t_s``; variables of contacts
            are over ``t_s`` and ``patch``. Attributes of variables are ``units`` and ``long_name``, attributes of the
            root the run's name, status, settings and counters. Channels are in SI units and share the run's memory.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        try:
            import xarray
        except ImportError:
            raise InputError("to_xarray", "xarray", "expected it installed: pip install xarray") from None
        nodes = {}
        for group, channels in self.groups.items():
            variables = {}
            for name, values in channels.items():
                said = {"units": unit_of(name), "long_name": DESCRIPTIONS.get(name, name.replace("_", " "))}
                variables[name] = ("t_s", "patch")[: values.ndim], values, said
            nodes[f"/{group}"] = xarray.Dataset(variables)
        about = {"name": self.scene.get("name", ""), "status": self.status, "reason": self.reason}
        numbers = {name: value for part in (self.settings, self.counters) for name, value in part.items()}
        about |= {name: value for name, value in numbers.items() if isinstance(value, str | int | float)}
        time = {"t_s": ("t_s", self.t, {"units": "s", "long_name": DESCRIPTIONS["t"]})}
        return xarray.DataTree.from_dict({"/": xarray.Dataset(coords=time, attrs=about), **nodes})

    @checked
    def wheel_forces(self, wheelset: str = "wheelset") -> pd.DataFrame:
        """Return forces, wear and pressure of a wheelset's wheels over time as a table.

        Parameters
        ----------
        wheelset : str
            Name of the wheelset's group.

        Returns
        -------
        pandas.DataFrame
            Index ``t_s``; per side (``left``, ``right``) ``Q_left_N`` (vertical), ``Y_left_N`` (lateral, to the field
            side), ``Y_over_Q_left``, ``T_gamma_left_N``, ``T_gamma_spin_left_N``, ``creep_power_left_W`` and
            ``p_max_left_Pa``; ``sum_Y_N``, the lateral force on the track, to the left. Definitions:
            :mod:`wrcore.run.output.derived`.

        Raises
        ------
        KeyError
            If the run has no such wheelset.
        """
        return wrcore.wheelset_channels(self, wheelset)

    @checked
    def plot(self, *channels: str) -> Figure:
        """Draw the run over time.

        Parameters
        ----------
        *channels : str
            Such as ``"wheelset.yaw_rad"`` or ``"wheelset/left.N_N"``, one panel each. By default: lateral position and
            yaw of the wheelsets and, if the run has contacts, the vertical and the lateral force of each wheel.

        Returns
        -------
        matplotlib.figure.Figure
            A notebook shows it; ``figure.savefig("run.png")`` writes it.

        Raises
        ------
        InputError
            If the run does not have a channel.
        """
        return wrcore.plot_run(self, channels)

    @checked
    def save(self, path: str | PathLike[str]) -> None:
        """Write the run to a file (HDF5), for :func:`wrcore.load_run`."""
        wrcore.write_run(path, self)
