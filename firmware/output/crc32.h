// SPDX-License-Identifier: Apache-2.0
// CRC-32 as in IEEE 802.3 (polynomial 0xEDB88320, reflected).
#ifndef WAYMARK_OUTPUT_CRC32_H
#define WAYMARK_OUTPUT_CRC32_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// Continues the sum `crc` of the bytes before; 0 at the beginning.
uint32_t crc32_of(uint32_t crc, const void *bytes, size_t count);

#ifdef __cplusplus
}
#endif

#endif
