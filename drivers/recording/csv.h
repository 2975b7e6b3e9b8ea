// SPDX-License-Identifier: Apache-2.0
// CSV of the recording format: UTF-8, commas, one header line whose columns are found by name, no quotes, empty =
// absent. Streaming; memory is fixed. Whole numbers never go through a double.
#ifndef WM_RECORDING_CSV_H
#define WM_RECORDING_CSV_H

#include "lines.h"
#include "waymark/source.h"

#define CSV_COLUMNS_MAX 18  // of a format
#define CSV_FIELDS_MAX 64   // of a file

typedef enum csv_type {
  CSV_TIME,    // int64 nanoseconds, at most 4e18 in size, so that differences fit
  CSV_WHOLE,   // int32
  CSV_NUMBER,  // double
  CSV_NAME     // text, kept as it stands in the line
} csv_type;

typedef enum csv_need {
  CSV_OPTIONAL,   // the column may be missing, a field may be empty
  CSV_MAY_EMPTY,  // the column must be there, a field may be empty
  CSV_ONE_OF,     // one of the columns marked so is required; a field may be empty
  CSV_NEEDED      // the column must be there and filled
} csv_need;

typedef struct csv_column {
  const char *name;
  csv_type type;
  csv_need need;
  double min, max;  // inclusive; min DBL_MIN reads "above 0"
} csv_column;

// Columns of a kind of file; ends with a column without name. csv_row has the same order.
typedef struct csv_format {
  csv_column columns[CSV_COLUMNS_MAX];
} csv_format;

typedef struct csv_row {
  int64_t whole[CSV_COLUMNS_MAX];  // CSV_TIME and CSV_WHOLE; WM_TIME_NONE where absent
  double number[CSV_COLUMNS_MAX];  // CSV_NUMBER; NaN where absent
  const char *name;                // CSV_NAME, "" where absent; not terminated, holds until the next row
  size_t name_length;
  long line;
} csv_row;

typedef struct csv_field {
  const char *text;
  size_t length;
} csv_field;

typedef struct csv_reader {
  line_reader lines;
  const csv_format *format;
  int place[CSV_COLUMNS_MAX];  // field of each known column, -1 where the file lacks it
  size_t field_count;          // of the header
  csv_field fields[CSV_FIELDS_MAX];
  size_t fields_found;       // in the current line
  const char *line_problem;  // why the line can't be read; NULL: it can
  wm_row_problem problem;    // of the line that csv_read refused last
} csv_reader;

// Opens the file and reads its header. A missing or doubled column is an error with its name. Unknown columns are
// ignored, with a line to `warn`.
wm_status csv_open(csv_reader *self, const char *path, const csv_format *format, wm_warn_fn warn, void *context,
                   wm_error *err);
void csv_close(csv_reader *self);
// Reads and splits the next line that isn't blank. WM_OK, WM_END, WM_IO.
wm_status csv_next(csv_reader *self, wm_error *err);
// The CSV_NAME field of the current line ("" where the line is too short).
csv_field csv_name(const csv_reader *self);
// Parses the current line. WM_OK; WM_BAD_DATA: malformed; WM_NOT_FINITE: an impossible value. err: FILE:LINE and the
// reason.
wm_status csv_read(csv_reader *self, csv_row *row, wm_error *err);
// "FILE:LINE: TEXT" for the current line; returns `status`.
wm_status csv_fail(const csv_reader *self, wm_error *err, wm_status status, const char *text);

#endif
