"""Fields of an image by name."""

from __future__ import annotations

import re
from typing import Any, Dict, Iterable, List, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native

_UNIT = re.compile(r"_(nms?_rad|rad_s2|rad_s|rad|m_s2|m_s|nms|nm|ns|n|m|a|v|c|s)$")


def unit_of(doc: str) -> str:
    """What stands in brackets at the begin of a field's line; "" when there is none."""
    found = re.match(r"\[([^\]]*)\]", doc)
    return found.group(1) if found else ""


def short_names(names: Iterable[str]) -> Dict[str, str]:
    """Names without their unit, as far as only one field has it: {"torque": "torque_nm"}."""
    known = list(names)
    found: Dict[str, List[str]] = {}
    for name in known:
        found.setdefault(_UNIT.sub("", name), []).append(name)
    return {s: full[0] for s, full in found.items() if len(full) == 1 and s not in known}


def numbers(what: str, value: ArrayLike) -> NDArray[np.float64]:
    """As floating point; ValueError names what is text, complex, or no number at all."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            raise TypeError
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{what}: is no array of numbers") from None


class Sealed:
    """Attributes are what the class made them: setting one would look as if it did something."""

    _advice: Dict[str, str] = {}  # by attribute: what to do instead

    def _seal(self) -> None:
        self.__dict__["_sealed"] = True

    def __setattr__(self, name: str, value: Any) -> None:
        if "_sealed" in self.__dict__ and not name.startswith("_"):
            advice = self._advice.get(name, "")
            kind = type(self).__name__
            raise _native.Error(f"{kind}.{name}: cannot be set{advice and f' ({advice})'}")
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        raise _native.Error(f"{type(self).__name__}.{name}: cannot be deleted")


class Fields:
    """Arrays by name, as attributes and as items: `fields.torque`, `fields["torque_nm"]`.

    A name may leave out its unit. The arrays look into the run: they change with each cycle, so
    copy what you keep. `units` has each field's unit, `docs` its line.
    """

    units: Dict[str, str]
    docs: Dict[str, str]
    # Those of every robot, (joints,) each; dir() has the others.
    position: NDArray[np.float64]  #: [rad or m] link side
    velocity: NDArray[np.float64]  #: [rad/s or m/s] link side
    torque: NDArray[np.float64]  #: [Nm or N] on the link

    def __init__(
        self, name: str, fields: List[Tuple[str, NDArray[Any], str]], joints: List[str]
    ) -> None:
        arrays = {field: array for field, array, _ in fields}
        arrays.update({short: arrays[full] for short, full in short_names(arrays).items()})
        own = self.__dict__  # found before __getattr__, at no cost
        own.update(arrays)
        own["_name"], own["_arrays"], own["_joints"] = name, arrays, joints
        own["docs"] = {field: doc for field, _, doc in fields}
        own["units"] = {field: unit_of(doc) for field, _, doc in fields}
        own["units"].update({s: own["units"][f] for s, f in short_names(own["units"]).items()})

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_"):
            raise AttributeError(name)
        arrays: Dict[str, NDArray[Any]] = self.__dict__["_arrays"]
        if name.lower() not in arrays:
            _native.unknown(f"field of the {self.__dict__['_name']}", name, list(arrays))
        return arrays[name.lower()]

    def __getitem__(self, name: str) -> NDArray[Any]:
        array: NDArray[Any] = getattr(self, name)
        return array

    def __setattr__(self, name: str, value: ArrayLike) -> None:
        array = getattr(self, name)
        what = f"{self._name}.{name}"
        if not array.flags.writeable:
            raise _native.Error(f"{what}: cannot be written (only what a command refers to can)")
        values = numbers(what, value)
        if values.shape not in ((), array.shape):
            raise ValueError(f"{what}: has the shape {values.shape}, wanted {array.shape}")
        if not np.isfinite(values).all():
            bad = int(np.argmax(~np.isfinite(np.broadcast_to(values, array.shape))))
            raise ValueError(f"{what}: of {self._joints[bad]} is not finite")
        array[...] = values

    __setitem__ = __setattr__

    def __dir__(self) -> List[str]:
        return sorted(self._arrays) + ["docs", "units"]

    def __repr__(self) -> str:
        return f"<{self._name}: {', '.join(self.docs)}>"
