// SPDX-License-Identifier: Apache-2.0
// Rows of a table of parameters, for files that call their struct `params`.
#ifndef WAYMARK_ESTIMATOR_PARAM_ROWS_H
#define WAYMARK_ESTIMATOR_PARAM_ROWS_H

#include <stddef.h>

#include "waymark/params.h"

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(params, field), initial, min, max, NULL, about }
#define I32(key, field, initial, min, max, about) \
  { key, WM_PARAM_I32, offsetof(params, field), initial, min, max, NULL, about }
#define BOOL(key, field, initial, about) \
  { key, WM_PARAM_BOOL, offsetof(params, field), initial, 0, 1, NULL, about }
#define ENUM(key, field, initial, last, names, about) \
  { key, WM_PARAM_ENUM, offsetof(params, field), initial, 0, last, names, about }

#endif
