// SPDX-License-Identifier: Apache-2.0
#include "waymark/params.h"

#include <string.h>

void wm_params_defaults(const wm_param_table *table, void *out) {
  memset(out, 0, table->bytes);
  for (size_t i = 0; i < table->count; i++) {
    const wm_param *p = &table->params[i];
    char *field = (char *)out + p->offset;
    if (p->type == WM_PARAM_F64) {
      memcpy(field, &p->initial, sizeof p->initial);
    } else {
      int32_t value = (int32_t)p->initial;
      memcpy(field, &value, sizeof value);
    }
  }
}
