# SPDX-License-Identifier: Apache-2.0
"""Waymark in Python: recordings and runs as arrays.

    import waymark
    run = waymark.Run("out/run")
    print(run.trajectory["x_m"].mean(), run.health["state"])
    again = waymark.replay("out/run/events.wmlog", changes={"sightings.noise.bearing_factor": 2})
"""

from typing import TYPE_CHECKING, Any

from .evaluation import eval
from .recording import CanFrame, Frame, Recording, RecordingWriter
from .run import Run, covariance
from .tables import Table, read_table, write_table


if TYPE_CHECKING:
    from .native import WaymarkError
    from .replaying import Estimate, EventLog, replay

__all__ = ["CanFrame", "Estimate", "EventLog", "Frame", "Recording", "RecordingWriter", "Run", "Table", "WaymarkError", "covariance",
           "eval", "read_table", "replay", "write_table"]


def __getattr__(name: str) -> Any:
    """What needs libwaymark.so is loaded when it is asked for: tables, recordings and runs need none."""
    if name in ("Estimate", "EventLog", "replay"):
        from . import replaying

        return getattr(replaying, name)
    if name == "WaymarkError":
        from .native import WaymarkError

        return WaymarkError
    raise AttributeError(f"module 'waymark' has no attribute '{name}'")
