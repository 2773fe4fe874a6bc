"""Tandem in Python: a robot's dynamics, logs as numpy arrays, and runs that Python steps.

    model = tandem.Model("config/panda/robot.toml")
    log = tandem.Log("runs/coman-squat-001.mcap")
    run = tandem.Run("config/panda/hold.toml", control="torque")

SI units, W's z axis upwards; docs/python.md is the guide, docs/conventions.md has the frames.
"""

try:
    from ._native import Error, UnknownName
    from ._native import __version__ as __version__
except ImportError as error:
    from ._why_not import why_not

    raise ImportError(why_not(error)) from error
from .control import Controllers, Parameters, Signals, Text
from .fields import Fields
from .log import Channel, Column, Event, Log
from .model import Model
from .run import Run

__all__ = [
    "Channel", "Column", "Controllers", "Error", "Event", "Fields", "Log", "Model", "Parameters",
    "Run", "Signals", "Text", "UnknownName",
]  # fmt: skip
