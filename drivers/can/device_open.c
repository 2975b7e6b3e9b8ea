// SPDX-License-Identifier: Apache-2.0
#include "can_device.h"
#include "waymark/devices.h"

wm_status wm_can_device_open(const wm_can_device_config *config, wm_can_part part, const double gnss_origin[3],
                             wm_source **out, uint32_t *quantities, wm_error *err) {
  wm_can_decoder *decoder;
  *out = NULL;
  wm_status status = wm_can_decoder_load(config->dbc, config->can_signals, part, &decoder, err);
  if (status != WM_OK || !decoder) return status;
  if (part == WM_CAN_MOTION) *quantities = wm_can_decoder_quantities(decoder);
  status = can_device_make(config->interface, decoder, &kSocketCan, NULL, out, err);
  if (status == WM_OK && part == WM_CAN_GNSS) can_device_gives_positions(*out, gnss_origin);
  return status;
}
