"""A run that Python steps."""

from __future__ import annotations

import json
import math
import operator
import os
import re
import warnings
import weakref
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from .control import Controllers, Sample, Signals, Text, ask, give_input, plain
from .fields import Fields, Sealed


class Run(Sealed):
    """A simulated robot with its controllers, stepped in this process.

        run = tandem.Run("config/panda/hold.toml", control="torque")
        for state in run:
            run.command.torque[:] = 50.0 * (goal - state.position) - 10.0 * state.velocity

    The run stands where a cycle's state has been read and its command is awaited, so a command
    acts in the cycle of the state that it answers, as a plugin's does. It runs to the bits that
    `tandem run` gives. At its end `state` is what the last command led to, the drives are still on,
    and step() is an error; finish() is the shut-down.

    Errors: tandem.Error, what `tandem check` would say, a line an error; FileNotFoundError;
    UnknownName (joint, field, mode); ValueError names what is not finite or has another shape,
    before anything was commanded. One thread at a time.
    """

    experiment: str  #: its file
    robot_file: str  #: for Model()
    joints: List[str]  #: in the order of the images
    seed: int
    period_s: float  #: of a cycle
    warnings: List[str]  #: what `tandem run` warns of; each is a UserWarning, too
    state: Fields  #: what was measured in this cycle, read only
    command: Fields  #: what Python commands; read only when controllers lead alone
    sent: Fields  #: what the drives were given last, behind the limits
    truth: Fields  #: what the simulation has, beside what is measured
    estimate: Optional[Fields]  #: with [estimation]
    limits: Dict[str, NDArray[np.float64]]  #: of each joint: "max_torque_Nm", …

    _advice = {
        "command": "write into it: run.command.torque[:] = values",
        "state": "it is what was measured",
    }

    def __init__(
        self,
        experiment: Union[str, "os.PathLike[str]"],
        *,
        control: Union[None, str, Mapping[str, str]] = None,
        seed: Optional[int] = None,
        duration_s: Union[None, float, str] = None,
        rate: Optional[float] = None,
        scenario: Union[str, "os.PathLike[str]"] = "",
        hal: str = "",
        on_fault: str = "",
        delay_cycles: Optional[int] = None,
        kernel_variant: str = "",
        build: bool = True,
        log: Union[None, str, "os.PathLike[str]"] = None,
    ) -> None:
        """Reads and checks everything, enables the drives, and stands at the first cycle of control.

        experiment: its file, or a bundled one's name as "panda/hold".
        control: None, the experiment's controllers lead. A mode ("position", "velocity", "torque",
        "current", "open_loop", "compliant"): Python leads every joint in it, and the experiment's
        controllers are left out. {joint: mode}: Python leads these, the controllers the others.
        duration_s [s] or "endless", seed, rate (1: real time, 0: as fast as it goes), scenario (file),
        hal, on_fault ("end", "wait"), delay_cycles, kernel_variant: instead of the experiment's.
        build: makes kernels that are missing.
        log: a folder, which gets ROBOT-EXPERIMENT-001.mcap or the next free number, or a new
        NAME.mcap. It is the log that `tandem run` writes. Such a run goes forward only: restore()
        is an error. finish() or close() ends the log, or else the end of the Run.
        """
        self.experiment = os.fspath(experiment)
        every, some = _control(control)
        _number("rate", rate, lambda x: x == 0.0 or 0.01 <= x <= 1000.0, "0, or 0.01 to 1000")
        if duration_s == "endless":
            duration_s = math.inf
        _number("duration_s", duration_s, lambda x: 0.0 < x <= 1e6 or x == math.inf,
                'above 0 to 1e6, or "endless"')  # fmt: skip
        seed, delay = _whole("seed", seed, 2**63 - 1), _whole("delay_cycles", delay_cycles, 1000)
        for key, text in dict(hal=hal, on_fault=on_fault, kernel_variant=kernel_variant).items():
            if not isinstance(text, str):
                raise ValueError(f"{key}: {text!r} is no text")
        native = _native.Run(
            self.experiment, every, some, seed, duration_s, rate, os.fspath(scenario), hal,
            on_fault, delay, kernel_variant, build, _place(log),
        )  # fmt: skip
        if log is not None:
            weakref.finalize(self, native.close)  # at the interpreter's end, too
        self._native, self._next = native, native.next
        self.joints, self.seed, self.period_s = native.joints, native.seed, native.period_s
        self.robot_file, self.warnings, self.limits = (
            native.robot_file, native.warnings, native.limits(),
        )  # fmt: skip
        self.state = Fields("state", native.state(), self.joints)
        commands = native.command()
        for _, array, _ in commands:
            if array.dtype != np.float64:  # which cycle, which mode: the run's
                array.flags.writeable = False
        self.command = Fields("command", commands, self.joints)
        self.sent = Fields("sent", native.sent(), self.joints)
        self.truth = Fields("truth", native.truth(), self.joints)
        estimate = native.estimate()
        self.estimate = Fields("estimate", estimate, self.joints) if estimate else None
        for array in self.limits.values():
            array.flags.writeable = False
        self._seal()
        for warning in self.warnings:
            warnings.warn(warning, stacklevel=2)

    def __iter__(self) -> "Run":
        return self

    def __next__(self) -> Fields:
        """Commands, and the next state; the first time the state that there is.

        With on_fault="wait" it ends, too, when duration_s has passed in fault or held.
        """
        if self._next():
            return self.state
        raise StopIteration

    def step(self, cycles: int = 1) -> bool:
        """Gives the command in this cycle and the next ones, and reads the state behind them.

        Of several cycles, without Python between them. False: the run has ended. Ctrl-C is heard.
        """
        try:
            return self._native.step(cycles)
        except TypeError:
            raise ValueError(f"step: cycles: {cycles!r}, wanted a whole number from 1") from None

    def save(self) -> bytes:
        """Everything that the rest of the run depends on, the command as it stands included."""
        return self._native.save()

    def restore(self, snapshot: bytes) -> None:
        """Goes back, or on, to where save() was; iteration begins with that state.

        Also for another Run of the same robot, experiment, options, seed and control; duration_s
        may differ, and is then this run's. Errors: tandem.Error names what is not the same, or this
        run writes a log. The run is as it was then.
        """
        try:
            snapshot = bytes(memoryview(snapshot))
        except TypeError:
            kind = type(snapshot).__name__
            text = f"snapshot: is of the type {kind}, wanted the bytes of save()"
            raise ValueError(text) from None
        self._native.restore(snapshot)

    def inject(self, kind: str, **keys: Any) -> None:
        """Injects a fault, with the keys of a scenario's [[fault]] (docs/configuration.md).

            run.inject("push", joint="panda_joint4", force_N=[0, 40, 0], for_s=0.1)
        """
        lines = (_toml(key, _listed(value)) for key, value in {"kind": kind, **keys}.items())
        self._native.inject("[[fault]]\n" + "\n".join(lines) + "\n")

    @property
    def controllers(self) -> Controllers:
        """Live parameters: `run.controllers["squat"]["kp"] = 40` takes effect in this cycle.

        It is an event of the log, and part of snapshots.
        """
        return Controllers(self._native)

    @property
    def signals(self) -> Signals:
        """What controllers tell: `run.signals["squat"].depth`, an array that changes each cycle."""
        return Signals(self._native, self.joints)

    def input(self, name: str, sample: Sample) -> None:
        """Gives an input of a controller a sample, which this cycle's update takes.

        Not in the first cycle of control, in which the controllers start.

            run.input("rate", {"scale": 0.5})
            run.input("path", [{"after_s": 1.0, "position_rad": [0.3, 0.2]}])

        Errors: tandem.Error with the name: no such input or component, out of bounds, another
        source feeds it, the controller does not run.
        """
        give_input(self._native, name, sample)

    @property
    def texts(self) -> List[Text]:
        """What controllers said since the run was opened or restored: the last 256."""
        return [Text(*row) for row in self._native.texts()]

    def ask(self, command: str, **keys: Any) -> Dict[str, Any]:
        """A command of the control socket, with its keys and its answer (docs/json.md).

            run.ask("joint.home", joint="slide")
            run.ask("controller.switch", stop=["hold"], start=["squat"])

        Those of controllers, inputs, joints, sensors and signals, carried out in this cycle.
        Errors: tandem.Error, the command's.
        """
        return ask(self._native, command, keys)

    def stop(self, category: int = 1) -> None:
        """An emergency stop in this cycle: category 0, 1 or 2 (docs/safety.md)."""
        self._native.stop(category)

    def reset_faults(self) -> None:
        """Clears every fault in this cycle, and enables the drives again; needs on_fault="wait".

        That takes some cycles. Then the phase is "held", until start(); with the experiment's
        after_reset = "continue", "running".
        """
        self._native.reset_faults()

    def start(self) -> None:
        """After a reset, in the phase "held": controllers and Python lead again, in this cycle.

        `command` begins with what is measured. Error: tandem.Error, another phase.
        """
        self._native.start()

    def finish(self) -> None:
        """Ends the run, if it has not ended, and simulates its shut-down: the drives are disabled.

        A log is closed then.
        """
        self._native.finish()

    def close(self) -> None:
        """Ends the log where the run stands: step() is an error from then on.

        Error: tandem.Error, the log lost messages (disk full, file gone), as finish() says it.
        """
        self._native.close()

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def log(self) -> Optional[str]:
        """The log's path; None: nothing is logged."""
        return self._native.log or None

    def joint(self, name: str) -> int:
        """Where a joint is in the arrays."""
        if name not in self.joints:
            _native.unknown("joint", str(name), self.joints)
        return self.joints.index(name)

    @property
    def cycle(self) -> int:
        """Number of the cycle."""
        return int(self.state.cycle[0])

    @property
    def time_s(self) -> float:
        """Its nominal time since the start [s]."""
        return float(self.state.time_ns[0]) / 1e9

    @property
    def phase(self) -> str:
        """ "running" while controllers lead; "faulted", "held", …, "done" (docs/architecture.md)."""
        return self._native.phase

    @property
    def over(self) -> bool:
        """Controllers have ended: by time, by a fault, or by finish()."""
        return self._native.over

    @property
    def faults(self) -> List[Dict[str, Any]]:
        """Every fault so far: time_s, cycle, joint, board, text, category, latched."""
        return self._native.faults()

    @property
    def result(self) -> Dict[str, Any]:
        """Figures so far, as in `tandem run --json`: those of the simulation, not of the program.

        `ended` is None while the run goes on.
        """
        figures: Dict[str, Any] = json.loads(self._native.result())
        return figures

    def __repr__(self) -> str:
        return f"<Run of {self.experiment}: {self.phase}, {self.time_s:.3f} s>"


def _control(control: Any) -> Tuple[str, Dict[str, str]]:
    """The mode of all joints, or those of some."""
    if control is None:
        return "", {}
    if isinstance(control, str) and control:
        return control, {}
    if isinstance(control, Mapping) and control:
        if all(isinstance(word, str) for item in control.items() for word in item):
            return "", dict(control)
    raise ValueError(f"control: {control!r}, wanted None, a mode, or a mode by joint")


def _number(name: str, value: Any, fits: Callable[[float], bool], wanted: str) -> None:
    if value is None:
        return
    if not isinstance(value, (int, float, np.integer, np.floating)) or not fits(value):
        raise ValueError(f"{name}: {value!r}, wanted {wanted}")


def _toml(key: str, value: Any) -> str:
    """A line `key = value`."""
    if not re.fullmatch(r"[A-Za-z0-9_-]+", key):
        raise ValueError(f"inject: {key!r} is no key")
    for one in value if isinstance(value, list) else [value]:
        if not isinstance(one, (bool, int, float, str, list)):
            raise ValueError(f"inject: {key}: {value!r} is no number, text, or list of them")
        if isinstance(one, float) and not math.isfinite(one):
            raise ValueError(f"inject: {key}: {value!r} is not finite")
    return f"{key} = {json.dumps(value, ensure_ascii=False)}"


def _whole(name: str, value: Optional[int], most: int) -> Optional[int]:
    if value is not None and not 0 <= operator.index(value) <= most:
        raise ValueError(f"{name}: {value}, wanted 0 to {most}")
    return value


def _listed(value: Any) -> Any:
    """Of numpy's kinds, and of tuples, what TOML has a literal for."""
    value = plain(value)
    return [_listed(one) for one in value] if isinstance(value, (list, tuple)) else value


def _place(log: Union[None, str, "os.PathLike[str]"]) -> str:
    """Of the log; "": nowhere."""
    place = "" if log is None else os.fspath(log)
    if log is not None and (not place or "\0" in place):
        raise ValueError(f"log: {log!r} is no name of a folder or file")
    return place
