# SPDX-License-Identifier: Apache-2.0
"""Waymark in Python: recordings and runs as arrays.

    import waymark
    run = waymark.Run("out/run")
    print(run.trajectory["x_m"].mean(), run.health["state"])
"""

from .recording import CanFrame, Frame, Recording, RecordingWriter
from .run import Run, covariance
from .tables import Table, read_table, write_table

__all__ = ["CanFrame", "Frame", "Recording", "RecordingWriter", "Run", "Table", "covariance", "read_table", "write_table"]
