"""What a run's controllers let change and tell, through the commands of the control socket."""

from __future__ import annotations

import json
import math
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Sequence, Union

import numpy as np

from . import _native
from .fields import Fields, Sealed


class Text(NamedTuple):
    """What a controller said."""

    time_s: float  #: nominal, since the start
    cycle: int
    controller: str
    level: str  #: "info", "warn"
    text: str  #: one line


def plain(value: Any) -> Any:
    """Of numpy's kinds what JSON and TOML have a literal for."""
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


class NotFinite(ValueError):
    """A number that JSON has no literal for, with the key that has it."""


def ask(native: Any, command: str, keys: Mapping[str, Any]) -> Dict[str, Any]:
    """A command's answer. Error: NotFinite."""
    for key, value in keys.items():
        _refuse_not_finite(key, value)
    question = json.dumps({"do": command, **keys}, default=_of_numpy)
    answer: Dict[str, Any] = json.loads(native.ask(question))
    del answer["ok"]
    return answer


def _of_numpy(value: Any) -> Any:
    if not isinstance(value, (np.ndarray, np.generic)):
        raise TypeError(f"{value!r} is nothing that a command can be given")
    return value.tolist()


def _refuse_not_finite(key: str, value: Any) -> None:
    value = plain(value)
    if isinstance(value, Mapping):
        for name, one in value.items():
            _refuse_not_finite(str(name), one)
    elif isinstance(value, (list, tuple)):
        for one in value:
            _refuse_not_finite(key, one)
    elif isinstance(value, float) and not math.isfinite(value):
        raise NotFinite(f"{key}: {value} is not finite")


def _finite_or_text(value: Any) -> Any:
    """Numbers that are not finite as text."""
    value = plain(value)
    if isinstance(value, Mapping):
        return {name: _finite_or_text(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite_or_text(one) for one in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


class Parameters(Sealed, Mapping[str, Any]):
    """Parameters of a controller by name. Those that are live can be set, in this cycle.

    Errors: tandem.Error with the name: not live, out of range, another type; nothing is set then.
    """

    def __init__(self, native: Any, controller: str) -> None:
        self._native, self.controller = native, controller
        self._seal()

    @property
    def facts(self) -> Dict[str, Dict[str, Any]]:
        """Of each: type, unit, min, max, choices, default, value, live, doc (docs/json.md)."""
        shown = ask(self._native, "controller.show", {"name": self.controller})["controllers"][0]
        return {row["name"]: row for row in shown["parameters"]}

    def __getitem__(self, name: str) -> Any:
        facts = self.facts
        if name not in facts:
            _native.unknown(f"parameter of {self.controller}", name, list(facts))
        return facts[name]["value"]

    def __setitem__(self, name: str, value: Any) -> None:
        self.update({name: value})

    def update(self, values: Mapping[str, Any]) -> None:
        """Sets several in one cycle, all or none."""
        ask(self._native, "controller.set", {"name": self.controller, "parameters": dict(values)})

    def __iter__(self) -> Iterator[str]:
        return iter(self.facts)

    def __len__(self) -> int:
        return len(self.facts)

    def __repr__(self) -> str:
        return f"<parameters of {self.controller}: {dict(self)}>"


class Controllers(Sealed, Mapping[str, Parameters]):
    """The parameters of each loaded controller: `run.controllers["squat"]["kp"] = 40`."""

    def __init__(self, native: Any) -> None:
        self._native = native
        self._seal()

    def __getitem__(self, name: str) -> Parameters:
        if name not in list(self):
            _native.unknown("controller", name, list(self))
        return Parameters(self._native, name)

    def __iter__(self) -> Iterator[str]:
        rows = ask(self._native, "controller.list", {})["controllers"]
        return iter([row["name"] for row in rows])

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __repr__(self) -> str:
        return f"<controllers: {', '.join(self)}>"


class Signals(Sealed, Mapping[str, Any]):
    """Signals by controller: `run.signals["squat"].depth`, or in one, `run.signals["squat.depth"]`.

    Arrays look into the controller as those of `run.state` into the run.
    """

    def __init__(self, native: Any, joints: List[str]) -> None:
        self._fields = {name: Fields(name, rows, joints) for name, rows in native.signals()}
        self._seal()

    def __getitem__(self, name: str) -> Any:
        controller, _, signal = name.rpartition(".")
        if name in self._fields or not controller:
            controller, signal = name, ""
        if controller not in self._fields:
            _native.unknown("controller with signals", controller, list(self._fields))
        fields = self._fields[controller]
        return fields[signal] if signal else fields

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)


Sample = Union[Mapping[str, float], Sequence[Mapping[str, Any]]]


def give_input(native: Any, name: str, sample: Sample) -> None:
    """Components by name, or a trajectory's points."""
    if isinstance(sample, Mapping):
        keys: Dict[str, Any] = {"values": dict(sample)}
    elif isinstance(sample, Sequence) and not isinstance(sample, str):
        keys = {"trajectory": {"points": [dict(point) for point in sample]}}
    else:
        raise ValueError(f"{name}: wanted numbers by component, or a list of points")
    try:
        ask(native, "input.set", {"name": name, **keys})
    except NotFinite:
        try:  # it is refused there, too, which counts it
            ask(native, "input.set", {"name": name, **_finite_or_text(keys)})
        except _native.Error:
            pass
        raise
