# SPDX-License-Identifier: Apache-2.0
"""Tables, stamps and text: pandas, polars, numpy, YAML, JSON."""

import datetime
import io
import json
import os
import time

import numpy as np
import pandas as pd
import polars as pl
import yaml
from asammdf import MDF, Signal

PANDAS, POLARS, NUMPY, YAML, MDFS = f"pandas {pd.__version__}", f"polars {pl.__version__}", f"numpy {np.__version__}", f"PyYAML {yaml.__version__}", "asammdf 8.8.28"
NS = 1700000000123456789


def rows():
    stamps = "`t_ns`: integers of nanoseconds, never floating point"
    for text in ("2026-01-01T00:00:00.5", "2026-01-01T00:00:00.500000001"):
        number = int(pd.to_datetime([text]).astype("int64")[0])
        yield f"pandas: to_datetime of {text} as an integer", f"{'nano' if number > 10**18 else 'micro'}seconds", PANDAS, stamps
    ranged = int(pd.date_range("2026-01-01", periods=1).astype("int64")[0])
    yield "pandas: date_range as integers", f"{'nano' if ranged > 10**18 else 'micro'}seconds", PANDAS, stamps
    read = pd.read_csv(io.StringIO(f"t_ns,x\n{NS},1\n,2\n"))["t_ns"]
    yield "pandas read_csv: a column of nanoseconds with one empty field", f"{read.dtype}, {abs(int(read[0]) - NS)} ns off", PANDAS, "`waymark.read_table`: int64, absent -1"
    x = pd.Series([0, np.nan, 10.0, np.nan], index=pd.to_datetime([0, 9, 10, 11], unit="s"))
    yield "pandas interpolate: between 0 at 0 s and 10 at 10 s, at 9 s", f"{x.interpolate().iloc[1]:.0f}; with method=\"time\" {x.interpolate('time').iloc[1]:.0f}", PANDAS, "by stamps"
    yield "pandas interpolate: beyond the last value", f"{x.interpolate().iloc[3]:.0f}", PANDAS, "no value"
    here = os.environ.get("TZ", "UTC")
    os.environ["TZ"] = "America/New_York"
    time.tzset()
    zone = pd.Timestamp("2026-01-01").timestamp(), datetime.datetime(2026, 1, 1).timestamp()
    os.environ["TZ"] = here
    time.tzset()
    yield "pandas and datetime: the second of 2026-01-01 without a zone, in New York", f"{(zone[1] - zone[0]) / 3600:.0f} h apart", PANDAS, "UTC where a message states it, else the computer's monotonic clock"
    yield "pandas resample(\"1s\").mean(): stamp of the values of 0.0 and 0.4 s", f"{pd.Series([1.0, 2.0], index=pd.to_datetime([0.0, 0.4], unit='s')).resample('1s').mean().index[0].second} s: the begin", PANDAS, "no resampling"
    joined = pd.merge_asof(pd.DataFrame({"t": [1.9]}), pd.DataFrame({"t": [1.0, 2.0], "v": [1, 2]}), on="t")["v"][0]
    yield "pandas merge_asof: partner of 1.9 among 1.0 and 2.0", f"{joined}.0: the one before", PANDAS, "-"
    frame = pd.read_json(io.StringIO('[{"timestamp": 100000000, "x": 1}]'))
    yield "pandas read_json: a number of 100000000 in a column named timestamp", f"a date of {frame['timestamp'][0].year}", PANDAS, "-"
    stamp = pl.Series([NS]).cast(pl.Datetime("ns")).dt.timestamp()[0]
    yield "polars dt.timestamp() of a column of nanoseconds", f"{'nano' if stamp > 10**18 else 'micro'}seconds", POLARS, stamps
    yield "polars str.to_datetime of nine decimals", f"{str(pl.Series(['2026-01-01T00:00:00.123456789']).str.to_datetime().dtype.time_unit)}: three of them are cut", POLARS, stamps
    tie = pl.DataFrame({"t": [5.0]}).join_asof(pl.DataFrame({"t": [0.0, 10.0], "v": [0, 10]}), on="t", strategy="nearest")["v"][0]
    yield "polars join_asof, nearest: half-way between two", "the later one" if tie else "the earlier one", POLARS, "-"
    made = np.genfromtxt(io.StringIO("id,x\n1,2\n,3"), delimiter=",", names=True, dtype=None, encoding="utf8")["id"][1]
    yield "numpy genfromtxt: an integer that is missing", f"{made}", NUMPY, "-1 as well: no identity"
    made = int(np.genfromtxt(io.StringIO(f"t_ns,x\n{NS},2\n"), delimiter=",", names=True)["t_ns"])
    yield "numpy genfromtxt: a stamp in nanoseconds", f"{abs(made - NS)} ns off", NUMPY, stamps
    yield "numpy int64 of a NaN", f"{np.array([np.nan]).astype(np.int64)[0]}", NUMPY, "refused"
    yield "Python fromisoformat of nine decimals", f"{datetime.datetime.fromisoformat('2026-01-01T00:00:00.123456789').microsecond} us: three of them are cut", "Python 3.11", stamps
    for text in ("1e-3", "010", "12:30:00", "no"):
        value = yaml.safe_load(f"a: {text}")["a"]
        yield f"PyYAML: `{text}`", f"{value!r} ({type(value).__name__})".replace("'", ""), YAML, {"1e-3": "0.001", "010": "refused or 10, by its key", "12:30:00": "refused where a number is needed", "no": "text; a switch is `true` or `false`"}[text]
    yield "JSON by floating point (JavaScript, `parse_int=float`): a stamp in nanoseconds", f"{abs(int(json.loads(str(NS), parse_int=float)) - NS)} ns off", "IEEE 754", "event logs and CSV have integers"
    log = MDF()
    log.append([Signal(np.array([1.0, 2.0]), np.array([100.0, 100.5]), name="speed")])
    log.append([Signal(np.array([358.0, 2.0]), np.array([100.5, 101.5]), name="heading")])
    table = log.to_dataframe(raster=0.5)
    yield "asammdf to_dataframe: a heading before its first sample", f"{table['heading'].iloc[0]:.0f}: its first value", MDFS, "no value"
    yield "asammdf to_dataframe: between headings of 358 and 2", f"{table['heading'].iloc[2]:.0f}", MDFS, "the short way"
    yield "asammdf to_dataframe: first stamp of a log that begins at 100 s", f"{table.index[0]:.0f}", MDFS, "stamps stay as they are"
