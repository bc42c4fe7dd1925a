/* SPDX-License-Identifier: Apache-2.0 */
/* CRC-32C by the method chosen for this processor, against a bit-by-bit computation, at every length and alignment up
 * to a word. */
#include "common/base/crc.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static uint32_t crc_by_bits(uint32_t crc, const uint8_t *p, size_t size)
{
	crc = ~crc;
	for (size_t i = 0; i < size; i++) {
		crc ^= p[i];
		for (int k = 0; k < 8; k++)
			crc = crc & 1 ? crc >> 1 ^ 0x82F63B78u : crc >> 1;
	}
	return ~crc;
}

static void crc_is_right_at_every_length_and_alignment(void **state)
{
	(void)state;
	uint8_t bytes[80];
	for (size_t i = 0; i < sizeof bytes; i++)
		bytes[i] = (uint8_t)(i * 151 + 7);
	for (size_t offset = 0; offset < 8; offset++)
		for (size_t n = 0; n + offset <= sizeof bytes; n++) {
			assert_int_equal(crc32c(0, bytes + offset, n), crc_by_bits(0, bytes + offset, n));
			assert_int_equal(crc32c(crc32c(0, bytes, offset), bytes + offset, n),
					 crc_by_bits(0, bytes, offset + n));
		}
	assert_int_equal(crc32c(0, "123456789", 9), 0xE3069283u);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(crc_is_right_at_every_length_and_alignment)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
