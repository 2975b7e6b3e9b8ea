# SPDX-License-Identifier: Apache-2.0
"""Waymark in Python: recordings and runs as arrays.

Example::

    import waymark
    run = waymark.Run("out/run")
    print(run.trajectory["x_m"].mean(), run.health["state"])
    again = waymark.replay("out/run/events.wmlog", changes={"sightings.noise.bearing_factor": 2})
    for message in waymark.Live():
        print(message.kind, message.data.t_ns)
"""

from typing import TYPE_CHECKING, Any

from .evaluation import eval
from .maps import FloorPlan, read_floor_plan, read_landmarks, write_floor_plan, write_landmarks
from .recording import CanFrame, Frame, Recording, RecordingWriter
from .run import Run, covariance
from .tables import Array, Table, read_table, write_table

if TYPE_CHECKING:
    from .lcm_fields import build, plain
    from .live import Live
    from .native import WaymarkError
    from .replaying import Estimate, EventLog, parameters, replay

__all__ = ["Array", "CanFrame", "Estimate", "EventLog", "FloorPlan", "Frame", "Live", "Recording", "RecordingWriter", "Run", "Table",
           "WaymarkError", "build", "covariance", "eval", "parameters", "plain", "read_floor_plan", "read_landmarks", "read_table", "replay",
           "write_floor_plan", "write_landmarks", "write_table"]


def __getattr__(name: str) -> Any:
    """What needs libwaymark.so or LCM is loaded when it is asked for: tables, recordings and runs need neither."""
    if name.endswith("_t") and not name.startswith("_"):
        from . import lcm_types

        if name in lcm_types.load():
            return lcm_types.load()[name]
    if name == "Live":
        from .live import Live

        return Live
    if name in ("build", "plain"):
        from . import lcm_fields

        return getattr(lcm_fields, name)
    if name in ("Estimate", "EventLog", "parameters", "replay"):
        from . import replaying

        return getattr(replaying, name)
    if name == "WaymarkError":
        from .native import WaymarkError

        return WaymarkError
    raise AttributeError(f"module 'waymark' has no attribute '{name}'")
