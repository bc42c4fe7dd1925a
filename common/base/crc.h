/* SPDX-License-Identifier: Apache-2.0 */
/*
 * CRC-32C (Castagnoli 1993), reflected, polynomial 0x82F63B78: detects incomplete or damaged records. Start with crc 0;
 * crc32c(crc32c(0, a), b) is the CRC of a followed by b. Any thread; at least about 1 GB/s.
 */
#ifndef COMMON_BASE_CRC_H
#define COMMON_BASE_CRC_H

#include <stddef.h>
#include <stdint.h>

uint32_t crc32c(uint32_t crc, const void *bytes, size_t size);

#endif
