// SPDX-License-Identifier: Apache-2.0
// The entry guard of the interface. A handle is no address: it names a row of a table and the generation of what is in
// that row, so that any value, also a freed or a foreign one, is checked without being read through. A call holds its
// row: a second one of the same handle, from a callback or another thread, is refused.
#ifndef WAYMARK_LIBRARY_ENTRY_H
#define WAYMARK_LIBRARY_ENTRY_H

#include <stddef.h>

#include "waymark/status.h"

typedef enum entry_kind { ENTRY_SESSION = 1, ENTRY_LOG } entry_kind;

// An argument that may not be NULL: its name in the header.
typedef struct entry_argument {
  const char *name;
  int is_there;
} entry_argument;

#define ENTRY_GIVEN(argument) \
  { #argument, (argument) != NULL }
#define ENTRY_GIVEN_IF(condition, argument) \
  { #argument, (argument) != NULL || !(condition) }

// WM_BAD_USAGE with the name of the first argument that is NULL. `given` ends with a row without a name.
wm_status entry_check(const char *function, const entry_argument *given, wm_error *err);

// Checks the arguments, then the handle, and holds it until entry_leave. *object is what the handle stands for.
wm_status entry_begin(entry_kind kind, const char *function, const void *handle, const entry_argument *given,
                      void **object, wm_error *err);
void entry_leave(const void *handle);

// A handle of `object`. WM_FULL: ENTRY_HANDLES_MAX are open.
#define ENTRY_HANDLES_MAX 1024
wm_status entry_open(entry_kind kind, void *object, void **handle, wm_error *err);
// Ends a handle that entry_begin holds.
void entry_close(const void *handle);

// What the handle stands for, also during a call of it; NULL where it is no handle of an open object.
const void *entry_look(entry_kind kind, const void *handle);

#endif
