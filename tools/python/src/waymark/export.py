# SPDX-License-Identifier: Apache-2.0
"""`waymark export`: a run, with the recording where it is given, as one MCAP file of ROS 2 messages."""

import argparse
import heapq
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from .mcapio.estimates import diagnostics, estimate_streams
from .mcapio.place import place_streams
from .mcapio.sensors import sensor_streams
from .mcapio.writer import Item, McapFile
from .recording import Recording
from .ros import Messages
from .run import Run

_EXAMPLES = """examples:
  waymark export out/run --mcap run.mcap
  waymark export out/run --recording recordings/drive --pictures --can --mcap run.mcap

The file opens in Foxglove, Rerun, PlotJuggler and `ros2 bag play`; `waymark import` makes a recording of it again where
--recording was given. Exit code: 0 done, 1 the work failed, 2 usage."""


def export(run: Run, out: str | Path, recording: Recording | None = None, pictures: bool = False, can: bool = False,
           progress: Callable[..., None] | None = None) -> None:
    """Writes a run as MCAP. With `recording`: truth, map, mountings and the streams of its sensors, too.

    `pictures` and `can` add those of the recording. `progress`, if given, is called with the number of messages.
    """
    messages = Messages()
    streams: list[Iterator[Item]] = [*estimate_streams(messages, run), *place_streams(messages, run, recording)]
    if recording:
        streams += sensor_streams(messages, recording, pictures, can, run)
    with McapFile(out, messages) as file:
        if recording:
            file.attach(recording)
        for count, item in enumerate(heapq.merge(*streams, key=lambda item: item.log_ns)):
            file.write(item)
            if progress and count % 1000 == 0:
                progress(count)
        file.write(diagnostics(messages, run.health, file.newest_ns))


def main(argv: list[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="waymark export", description="Writes a run as one MCAP file of ROS 2 messages.",
                                     epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", metavar="RUN", help="folder that `waymark run` or `waymark replay` wrote")
    parser.add_argument("--mcap", metavar="FILE", required=True, help="the file to write")
    parser.add_argument("--recording", metavar="FOLDER", help="the recording: truth, map, mountings and its streams, too")
    parser.add_argument("--pictures", action="store_true", help="also the recording's pictures and what was detected in them")
    parser.add_argument("--can", action="store_true", help="also the recording's CAN frames")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    given = parser.parse_args(argv)
    if (given.pictures or given.can) and not given.recording:
        parser.error("--pictures and --can need --recording")
    out = Path(given.mcap)
    if out.exists() and not given.force:
        parser.error(f"{out} exists; --force overwrites it")
    progress = None
    if sys.stderr.isatty():
        progress = lambda count: print(f"\r{count} messages", end="", file=sys.stderr)  # noqa: E731
    part = out.with_name(out.name + ".part")
    try:
        export(Run(given.run), part, Recording(given.recording) if given.recording else None, given.pictures, given.can,
               progress)
        os.replace(part, out)
    except (OSError, ValueError, KeyError) as error:
        part.unlink(missing_ok=True)
        print(f"waymark export: {error}", file=sys.stderr)
        return 1
    if progress:
        print("\r\033[K", end="", file=sys.stderr)
    print(f"{out}: {out.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
