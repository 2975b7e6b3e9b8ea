#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds our CAN readers against python-can (logs) and cantools (DBC), over every file of can-samples and the
recordings.

usage: can_judge.py CAN_JUDGE_PROGRAM [DATA_FOLDER]      (default: the environment's WM_DATA_DIR)

Exit codes: 0 they agree, 1 they don't, 77 skipped (no data, or no judges: tests/judges/setup.sh installs them).
"""
import copy
import datetime
import decimal
import io
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

FRAMES_PER_MESSAGE = 40
RECORDING_STRIDE = 7
SEED = 20261121


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def run(program, *arguments, text):
    done = subprocess.run([program, *arguments], input=text.encode("latin-1"), capture_output=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{program} {' '.join(arguments)}: {done.stderr.decode('latin-1')}")
    return done.stdout.decode("latin-1").splitlines()


class Tally:
    """Counts what was compared, and prints the first disagreements of each part."""

    def __init__(self):
        self.wrong = 0

    def report(self, name, compared, wrong):
        if compared == 0:
            wrong = [*wrong, "nothing was compared"]
        print(f"{'ok' if not wrong else 'WRONG':5} {name}: {compared} compared, {len(wrong)} differ")
        for line in wrong[:8]:
            print("      " + line)
        self.wrong += len(wrong)


# ── logs ────────────────────────────────────────────────────────────────────────────────────────────────────────────


def is_extended(message):
    """python-can's own test files have ids that need 29 bits marked as 11-bit ones."""
    return message.is_extended_id or message.arbitration_id > 0x7FF


def fields_of(message, t_ns, channel):
    """A python-can message as can_judge prints it. CAN FD has no remote frames: marked as such they are classic."""
    is_fd = message.is_fd and not message.is_remote_frame
    flags = message.bitrate_switch | message.error_state_indicator << 1 if is_fd else 0
    data = bytes(min(message.dlc, 8)) if message.is_remote_frame else bytes(message.data)
    identifier = message.arbitration_id & (0x1FFFFFFF if message.is_error_frame else 0xFFFFFFFF)
    extended = int(is_extended(message) and not message.is_error_frame)
    return (f"{t_ns} {channel} {identifier:X} {extended} {int(message.is_remote_frame)} {int(message.is_error_frame)} "
            f"{int(is_fd)} {flags:X} {len(data)} {data.hex().upper()}").strip()


def nanoseconds(text):
    return int(decimal.Decimal(text) * 1_000_000_000)


def judge_candump_logs(program, folder, tally):
    """Each line by our parser and by python-can's. Where python-can knows less (raw DLC, all four FD flags, error
    classes other than a bus error, classic frames of more than 8 bytes), the expectation is written out here."""
    import can
    for path in sorted(folder.glob("*.log")):
        lines = [line for line in path.read_text().splitlines() if line.strip()]
        ours, wrong = run(program, "candump", text="\n".join(lines) + "\n"), []
        if len(ours) != len(lines):
            wrong.append(f"{len(lines)} lines, {len(ours)} answers")
        for line, got in zip(lines, ours):
            t_ns = nanoseconds(re.match(r"\((\S+)\)", line).group(1))
            readable = re.sub(r"_[9A-F]$", "", line)
            with tempfile.NamedTemporaryFile("w", suffix=".log") as one:
                one.write(readable + "\n")
                one.flush()
                message = next(iter(can.CanutilsLogReader(one.name)))
            want = fields_of(message, t_ns, line.split()[1])
            fd = re.search(r"##([0-9A-F])", line)  # the flags as they stand there: python-can knows two of the four
            if fd:
                want = re.sub(r"^((?:\S+ ){7})\S+", rf"\g<1>{fd.group(1)}", want)
            oversized = re.search(r"[^#]#([0-9A-F]{17,})$", line)  # we take it for CAN FD
            if oversized:
                want = re.sub(r"^((?:\S+ ){6})0", r"\g<1>1", want)
            error = re.search(r" 2([0-9A-F]{7})(?:##.|#)([0-9A-F]*)", line)  # bit 29 of the id
            if error:
                fd_and_flags = f"1 {fd[1]}" if fd else "0 0"
                want = (f"{t_ns} {line.split()[1]} {int(error[1], 16):X} 0 0 1 {fd_and_flags} {len(error[2]) // 2} "
                        f"{error[2]}").strip()
            if want != got.strip():
                wrong.append(f"{line}: we read '{got}', python-can '{want}'")
        tally.report(f"candump {path.name}", len(ours), wrong)


def screen_fault(line, got):
    """What is wrong with our answer to a line of candump's screen; "": nothing. Without a time it is refused; else cantools' reader judges
    interface, id and bytes, but for error frames, which that one leaves out."""
    from cantools.logreader import Parser
    if not line.lstrip().startswith("("):
        return "" if "candump -l" in got else "it is not refused"
    frame = next(iter(Parser(io.StringIO(line + "\n"))), None)
    if frame is None or "ERRORFRAME" in line or not re.search(r"\]\s+\S", line):
        return ""
    t_ns, channel, identifier, _, remote, *_, data = (got.split() + [""] * 10)[:10]
    stated = re.match(r"\s*\(([\d.]+)\)", line)
    want_ns = nanoseconds(stated[1]) if stated else (frame.timestamp - datetime.datetime(1970, 1, 1)) // datetime.timedelta(microseconds=1) * 1000
    want = (str(want_ns), frame.channel, f"{frame.frame_id:X}", "" if remote == "1" else frame.data.hex().upper())
    return "" if (t_ns, channel, identifier, data) == want else f"cantools has {want}"


def judge_screen_output(program, folder, tally):
    for path in sorted(folder.glob("*.txt")):
        lines = [line for line in path.read_text().splitlines() if line.strip()]
        answers = run(program, "candump", text="\n".join(lines) + "\n")
        wrong = [f"{line}: {got}: {fault}" for line, got in zip(lines, answers) if (fault := screen_fault(line, got))]
        tally.report(f"screen output {path.name}", len(answers), wrong)


def as_candump(message):
    """The line that candump -l would have written, with the time in whole microseconds."""
    microseconds = round(decimal.Decimal(repr(message.timestamp)) * 1_000_000)
    identifier = f"{message.arbitration_id:08X}" if is_extended(message) else f"{message.arbitration_id:03X}"
    if message.is_error_frame:
        identifier = f"{message.arbitration_id & 0x1FFFFFFF | 0x20000000:08X}"
    sign = "-" if microseconds < 0 else ""
    seconds, rest = divmod(abs(microseconds), 1_000_000)
    if message.is_remote_frame:
        body = f"#R{min(message.dlc, 8)}"
    elif message.is_fd:
        body = f"##{message.bitrate_switch | message.error_state_indicator << 1:X}{bytes(message.data).hex().upper()}"
    else:
        body = f"#{bytes(message.data).hex().upper()}"
    return f"({sign}{seconds}.{rest:06d}) can{channel_of(message)} {identifier}{body}", int(microseconds) * 1000


def channel_of(message):
    return message.channel if isinstance(message.channel, int) else 0


def judge_other_logs(program, folder, tally):
    """ASC, BLF and TRC: python-can reads them; what it found goes through our parser and must come back the same."""
    import can
    for path in sorted(folder.iterdir()):
        if path.suffix not in (".asc", ".blf", ".trc"):
            continue
        messages = [m for m in can.LogReader(str(path)) if m is not None]
        pairs = [as_candump(m) for m in messages]
        ours = run(program, "candump", text="".join(line + "\n" for line, _ in pairs))
        wrong = [] if len(ours) == len(messages) else [f"{len(messages)} messages, {len(ours)} answers"]
        for message, (line, t_ns), got in zip(messages, pairs, ours):
            want = fields_of(message, t_ns, f"can{channel_of(message)}")
            if want != got.strip():
                wrong.append(f"{line}: we read '{got}', python-can '{want}'")
        if messages or path.stat().st_size > 2000:
            tally.report(f"log {path.name}", len(messages), wrong)
        else:
            print(f"      log {path.name}: python-can finds no frame in it")


# ── DBC ─────────────────────────────────────────────────────────────────────────────────────────────────────────────


def load(path):
    import cantools
    return cantools.database.load_file(str(path), encoding="cp1252", strict=False)


def same(ours, theirs):
    """The same double; where cantools computes in integers beyond 2^53, the nearest doubles to it."""
    if math.isnan(ours) or (isinstance(theirs, float) and math.isnan(theirs)):
        return math.isnan(ours) and math.isnan(float(theirs))
    theirs_as_double = float(theirs)
    if ours == theirs_as_double:
        return True
    return isinstance(theirs, int) and abs(theirs) > 2**53 and math.isclose(ours, theirs_as_double, rel_tol=2**-51)


def bytes_needed(signal):
    first = signal.start if signal.byte_order == "little_endian" else signal.start // 8 * 8 + 7 - signal.start % 8
    return (first + signal.length + 7) // 8


def message_of(signals, message, length, strict):
    import cantools
    return cantools.database.can.Message(message.frame_id, message.name, length, signals, strict=strict,
                                         is_extended_frame=message.is_extended_frame)


def alone(signal, message):
    """A message with this signal only, long enough for it: what overlaps elsewhere cannot disturb it."""
    twin = copy.copy(signal)
    twin.is_multiplexer, twin.multiplexer_ids, twin.multiplexer_signal = False, None, None
    return message_of([twin], message, 64, True)


class Oracle:
    """What cantools says of a frame. It cannot decode messages whose signals overlap or do not fit (cantools #205) or
    whose multiplexer is not marked by a capital M (vw_pq.dbc), nor frames in which a multiplexer reads what no signal
    is for: there each signal is decoded in a message of its own, and is there if the multiplexers say so."""

    def __init__(self, message):
        import cantools
        self.message, self.by_name = message, {s.name: s for s in message.signals}
        self.alone = {s.name: alone(s, message) for s in message.signals if bytes_needed(s) <= 64}
        try:
            self.whole = message_of(message.signals, message, message.length, True)
        except cantools.database.Error:
            self.whole = None
        if any(s.multiplexer_ids and not self.by_name[s.multiplexer_signal].is_multiplexer for s in message.signals):
            self.whole = None

    def is_there(self, signal, values):
        while signal.multiplexer_ids:
            if values.get(signal.multiplexer_signal) not in signal.multiplexer_ids:
                return False
            signal = self.by_name[signal.multiplexer_signal]
        return True

    def decode(self, data):
        """{signal: value}"""
        import cantools
        if self.whole:
            try:
                return self.whole.decode(data, decode_choices=False, allow_truncated=True)
            except cantools.database.DecodeError:
                pass
        values, padded = {}, data.ljust(64, b"\xff")
        for s in self.message.signals:
            if bytes_needed(s) <= len(data):
                values.update(self.alone[s.name].decode(padded, decode_choices=False))
        return {name: value for name, value in values.items() if self.is_there(self.by_name[name], values)}


def judge_frames(program, dbc, database, frames, name, tally):
    """frames: [(identifier, extended, data)], decoded by both."""
    oracles = {(m.frame_id, m.is_extended_frame): Oracle(m) for m in database.messages}
    lines, wants = [], []
    for identifier, extended, data in frames:
        code = f"{identifier:08X}" if extended else f"{identifier:03X}"
        lines.append(f"(1.0) can0 {code}{'##0' if len(data) > 8 else '#'}{data.hex()}\n")
        oracle = oracles.get((identifier, extended))
        wants.append((oracle.message.name, oracle.decode(data)) if oracle else None)
    got = [{} for _ in frames]
    for answer in run(program, "dbc", str(dbc), text="".join(lines)):
        number, message, signal, value = answer.split(" ")
        got[int(number)][message, signal] = float(value)
    wrong, compared = [], 0
    for line, want, ours in zip(lines, wants, got):
        if want is None:  # no message of this id in the DBC
            continue
        message, values = want
        for signal, value in values.items():
            compared += 1
            ours_value = ours.pop((message, signal), None)
            if ours_value is None:
                wrong.append(f"{line.strip()}: {message}.{signal} is {value}, and we leave it out")
            elif not same(ours_value, value):
                wrong.append(f"{line.strip()}: {message}.{signal} is {value!r}, we say {ours_value!r}")
        wrong += [f"{line.strip()}: we say {key} = {value}, cantools leaves it out"
                  for key, value in ours.items()]
    tally.report(name, compared, wrong)


def judge_definitions(program, dbc, database, tally):
    """Every message and signal of the file is there, with its length, factor, offset and range."""
    ours = {}
    for line in run(program, "list", str(dbc), text=""):
        message, identifier, extended, length, signal, kind, factor, offset, low, high, unit = line.split(" ", 10)
        ours[message, signal] = (int(identifier, 16), int(extended), int(length), int(kind), float(factor),
                                 float(offset), float(low), float(high), unit)
    wrong, compared = [], 0
    for message in database.messages:
        for s in message.signals:
            compared += 1
            kind = {32: 2, 64: 3}[s.length] if s.is_float else int(s.is_signed)
            want = (message.frame_id, int(message.is_extended_frame), message.length, kind, float(s.scale),
                    float(s.offset), float(s.minimum or 0), float(s.maximum or 0), s.unit or "")
            got = ours.pop((message.name, s.name), None)
            if got is None or got[:8] != want[:8] or got[8] != want[8].encode("cp1252", "replace").decode("latin-1"):
                wrong.append(f"{message.name}.{s.name}: {want}, and we have {got}")
    wrong += [f"{key} is not in cantools' reading" for key in ours]
    if compared:
        tally.report(f"definitions {dbc.parent.name}/{dbc.name}", compared, wrong)


def write_bits(payload, signal, raw):
    """Puts a signal's bits into a bytearray, bit by bit."""
    for i in range(signal.length):
        if signal.byte_order == "little_endian":
            byte, bit, value = (signal.start + i) // 8, (signal.start + i) % 8, raw >> i & 1
        else:
            stream = signal.start // 8 * 8 + 7 - signal.start % 8 + i
            byte, bit, value = stream // 8, 7 - stream % 8, raw >> (signal.length - 1 - i) & 1
        payload[byte] = payload[byte] & ~(1 << bit) | value << bit


def selecting(message, signal, rng):
    """A random payload in which the multiplexers above the signal read what it is for; the others anything they know."""
    payload, by_name = bytearray(rng.randbytes(message.length)), {s.name: s for s in message.signals}
    for other in message.signals:
        if other.multiplexer_ids and rng.random() < 0.5:
            write_bits(payload, by_name[other.multiplexer_signal], rng.choice(other.multiplexer_ids))
    while signal.multiplexer_ids:
        above = by_name[signal.multiplexer_signal]
        write_bits(payload, above, rng.choice(signal.multiplexer_ids))
        signal = above
    return bytes(payload)


def random_frames(database, rng):
    """All zeros, all ones, random ones; of multiplexed messages as many more for each multiplexed signal."""
    for message in database.messages:
        payloads = [bytes(message.length), b"\xff" * message.length]
        payloads += [rng.randbytes(message.length) for _ in range(FRAMES_PER_MESSAGE)]
        for signal in message.signals:
            if signal.multiplexer_ids and message.length:
                payloads += [selecting(message, signal, rng) for _ in range(FRAMES_PER_MESSAGE)]
        for payload in payloads:
            yield message.frame_id, message.is_extended_frame, payload


def judge_dbc_files(program, data, tally):
    rng = random.Random(SEED)
    files = sorted((data / "can-samples/dbc").glob("*/*.dbc")) + sorted(data.glob("*/vehicle.dbc"))
    for dbc in files:
        database = load(dbc)
        judge_definitions(program, dbc, database, tally)
        frames = [f for f in random_frames(database, rng) if len(f[2]) <= 64]
        if any(m.signals for m in database.messages):
            judge_frames(program, dbc, database, frames, f"random frames {dbc.parent.name}/{dbc.name}", tally)


def judge_recordings(program, data, tally):
    for log in sorted(data.glob("*/can.log")):
        frames = []
        for i, line in enumerate(log.open()):
            match = re.match(r"\(\S+\) \S+ ([0-9A-F]{3}|[0-9A-F]{8})#([0-9A-F]*)$", line.strip())
            if i % RECORDING_STRIDE == 0 and match:
                frames.append((int(match[1], 16), len(match[1]) == 8, bytes.fromhex(match[2])))
        dbc = log.parent / "vehicle.dbc"
        judge_frames(program, dbc, load(dbc), frames, f"recording {log.parent.name}", tally)


def judge_passat(program, data, tally):
    import can
    log, dbc = data / "can-samples/cars/passat-idling.trc", data / "can-samples/dbc/opendbc/vw_pq.dbc"
    frames = [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in can.LogReader(str(log))
              if not m.is_error_frame and not m.is_remote_frame]
    judge_frames(program, dbc, load(dbc), frames, "passat-idling.trc by vw_pq.dbc", tally)


def main():
    program = sys.argv[1]
    data = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else os.environ.get("WM_DATA_DIR", ""))
    if not (data / "can-samples").is_dir():
        skip(f"no {data}/can-samples")
    try:
        import can  # noqa: F401
        import cantools  # noqa: F401
    except ImportError:
        skip("python-can and cantools are not there; tests/judges/setup.sh installs them into .cache/venv")
    tally = Tally()
    judge_candump_logs(program, data / "can-samples/candump", tally)
    judge_screen_output(program, data / "can-samples/candump", tally)
    judge_other_logs(program, data / "can-samples/python-can", tally)
    judge_dbc_files(program, data, tally)
    judge_recordings(program, data, tally)
    judge_passat(program, data, tally)
    print(f"{tally.wrong} differences")
    return 1 if tally.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
