"""A run's log as numpy arrays."""

from __future__ import annotations

import os
import warnings
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from .fields import Sealed, short_names, unit_of


class Event(NamedTuple):
    """What happened once in a run."""

    time_s: float  #: nominal, since the start
    cycle: int
    kind: str  #: "fault of the drive", …
    joint: str  #: "" when it is none's
    text: str  #: one line


class Column(Sealed, np.lib.mixins.NDArrayOperatorsMixin):
    """One field over time: `column["LKneeSag"]` is a joint's (N,), `column.values` all of them.

    numpy takes it as `values`: `column - 1.0`, `np.abs(column)`.
    """

    name: str
    unit: str  #: "rad or m"
    doc: str
    names: List[str]  #: of the elements: joints, channels of sensors, or numbers
    values: NDArray[Any]  #: (N, len(names)), read only
    time_s: NDArray[np.float64]  #: (N,) nominal time since the start [s]

    def __init__(
        self, name: str, doc: str, names: List[str], values: NDArray[Any], time_s: NDArray[Any]
    ) -> None:
        self.name, self.doc, self.unit, self.names = name, doc, unit_of(doc), names
        self.values, self.time_s = values, time_s
        self._seal()

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """By an element's name, or as numpy does it."""
        if not isinstance(key, str):
            return np.asarray(self.values[key])
        if key not in self.names:
            _native.unknown(f"element of {self.name}", key, self.names)
        return self.values[:, self.names.index(key)]

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> NDArray[Any]:
        return np.array(self.values, dtype=dtype) if copy else np.asarray(self.values, dtype=dtype)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **keys: Any) -> Any:
        """Arithmetic is of the values; nothing is written into them."""
        if any(isinstance(one, Column) for one in keys.get("out", ())):
            return NotImplemented
        plain = (one.values if isinstance(one, Column) else one for one in inputs)
        return getattr(ufunc, method)(*plain, **keys)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def shape(self) -> Tuple[int, ...]:
        return self.values.shape

    def __repr__(self) -> str:
        return f"<{self.name} [{self.unit}] {self.values.shape}>"


class Channel(Sealed):
    """A channel of a log. Its numbers are read, all of them, when the first is asked for.

    Fields are attributes and items: `channel.position`, `channel["position_rad"]`; a name may leave
    out its unit.
    """

    name: str  #: "/tandem/state"
    type: str  #: "tandem/msg/State"
    messages: int
    first_s: float  #: time of the first message
    last_s: float
    fields: List[str]  #: [] when its messages are not all numbers of a fixed size
    # Those of most channels.
    position: Column
    velocity: Column
    torque: Column

    def __init__(self, file: Any, row: Tuple[Any, ...]) -> None:
        self._file = file
        self._columns: Optional[Dict[str, Column]] = None
        self._time_s: NDArray[np.float64] = np.empty(0)
        self.name, self.type, self.messages, self.first_s, self.last_s, fields = row
        self._elements: Dict[str, List[str]] = dict(fields)
        self.fields = list(self._elements)
        self._short = short_names(self.fields)
        self._seal()

    def _read(self) -> Dict[str, Column]:
        if self._columns is None:
            self._time_s, fields = self._file.read(self.name)
            self._columns = {
                name: Column(name, doc, self._elements[name], values, self._time_s)
                for name, values, doc in fields
            }
        return self._columns

    @property
    def time_s(self) -> NDArray[np.float64]:
        """(N,) nominal time of each message since the start [s]."""
        self._read()
        return self._time_s

    @property
    def units(self) -> Dict[str, str]:
        """Unit of each field; "" of those that have none."""
        if not self.fields:
            return {}
        return {name: column.unit for name, column in self._read().items()}

    def __getitem__(self, name: str) -> Column:
        full = self._short.get(name, name.lower())
        if self.fields and full not in self._elements:
            why = self._file.left_out(self.name, full)
            if why:
                raise _native.UnknownName(f"no such field of {self.name} '{name}': {why}")
            _native.unknown(f"field of {self.name}", name, self.fields)
        return self._read()[full]

    def __getattr__(self, name: str) -> Column:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __dir__(self) -> List[str]:
        return sorted({*super().__dir__(), *self.fields, *self._short})

    def __len__(self) -> int:
        return self.messages

    def __repr__(self) -> str:
        return f"<{self.name}: {self.messages} messages, {', '.join(self.fields)}>"


def _short_name(channel: str) -> str:
    """Without the leading parts that a name may leave out in any log."""
    return channel[len("/tandem/") :] if channel.startswith("/tandem/") else channel[1:]


class Log(Sealed):
    """A log of `tandem run`, opened: `log["state"].position["LKneeSag"]`, `log.events`.

    Of a log in several files the first one's name opens all, "arm-001.3.mcap" that part alone.
    Opening counts the messages; numbers are read channel by channel when they are asked for.
    What of a file is damaged or cut is not there: `remarks` say so, and a UserWarning.
    Errors: FileNotFoundError; tandem.Error, a file that is no log; UnknownName.
    """

    path: str
    robot: str
    joints: List[str]  #: in the order of the images
    channels: List[str]  #: their full names
    info: Dict[str, str]  #: who, where, when, seed, period, kernels, controllers
    result: Dict[str, str]  #: empty when the run was killed
    configuration: Dict[str, str]  #: text of every file that was read, by path
    parts: List[str]  #: its files: of a log in several, all that are there
    remarks: List[str]  #: which parts are missing, what is damaged, that it is cut; [] when none
    truncated: bool  #: the run was killed, or goes on: the data end where its last chunk ended
    data_sha256: str  #: over every message

    def __init__(self, path: Union[str, "os.PathLike[str]"]) -> None:
        file = _native.LogFile(os.fspath(path))
        self._file = file
        self.path, self.robot, self.joints = file.path, file.robot, file.joints
        self.info, self.result = dict(file.info), dict(file.result)
        self.configuration = dict(file.configuration)
        cut = [file.cut] if file.cut else []
        self.parts, self.remarks = file.parts, file.remarks + cut
        self.truncated, self.data_sha256 = file.truncated, file.data_sha256
        for lost in file.damage + cut:
            warnings.warn(f"{self.path}: {lost}", stacklevel=2)
        self._channels = {row[0]: Channel(file, row) for row in file.channels()}
        self.channels = list(self._channels)
        self._events: Optional[List[Event]] = None
        self._seal()

    @property
    def events(self) -> List[Event]:
        """In the order of their times."""
        if self._events is None:
            self._events = [Event(*row) for row in self._file.events()]
        return self._events

    def __getitem__(self, name: str) -> Channel:
        """A channel by its full name, or by the last parts of it: "state", "squat"."""
        full = self._file.full_name(name)
        if full in self._channels:
            return self._channels[full]
        why = self._file.left_out(full)
        if why:
            raise _native.UnknownName(f"no such channel of {self.path} '{name}': {why}")
        _native.unknown("channel of " + self.path, name, [_short_name(c) for c in self.channels])
        raise AssertionError

    def __iter__(self) -> Iterator[Channel]:
        return iter(self._channels.values())

    def __len__(self) -> int:
        return len(self._channels)

    def __repr__(self) -> str:
        return f"<Log of {self.robot}: {', '.join(self.channels)}>"
