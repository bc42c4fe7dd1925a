# SPDX-License-Identifier: Apache-2.0
# Tables that are generated at build time: published data as C initialisers, and the coefficients of upsampled colours.
TABLES := $(addprefix $(BUILD)/gen/,cie_observer.inc cie_d65.inc wavelength_cells.inc wavelength_guide.inc conductors.inc upsample_table.inc)
generated: $(TABLES)

$(BUILD)/gen/cie_observer.inc: worker/render/math/data/cie1931_2deg_1nm.csv
	@mkdir -p $(@D)
	awk -F, '!/^#/ { printf "{%s, %s, %s},\n", $$2, $$3, $$4 }' $< > $@.part && mv $@.part $@

$(BUILD)/gen/cie_d65.inc: worker/render/math/data/cie_d65_1nm.csv
	@mkdir -p $(@D)
	awk -F, '!/^#/ { printf "%s,\n", $$2 }' $< > $@.part && mv $@.part $@

# For each cell of 1 nm, the shares of sampled wavelengths below it and in it: a mixture of 95 % |r| + |g| + |b| and 5 % uniform
# (worker/render/math/spectrum.h). r, g, b are the matching functions of linear Rec. 709, by the matrix of common/base/color.h.
$(BUILD)/gen/wavelength_cells.inc: worker/render/math/data/cie1931_2deg_1nm.csv
	@mkdir -p $(@D)
	awk -F, 'function abs(v) { return v < 0 ? -v : v } \
		!/^#/ { curve[n++] = abs(3.2404541621141054 * $$2 - 1.5371385127977166 * $$3 - 0.4985314095560162 * $$4) + \
			abs(-0.9692660305051868 * $$2 + 1.8760108454466942 * $$3 + 0.0415560175303498 * $$4) + \
			abs(0.0556434309591147 * $$2 - 0.2040259135167538 * $$3 + 1.0572251882231791 * $$4) } \
		END { for (i = 0; i + 1 < n; i++) total += curve[i] + curve[i + 1]; \
			for (i = 0; i + 1 < n; i++) { \
				below = i == 0 ? 0 : sum; \
				sum += 0.95 * (curve[i] + curve[i + 1]) / total + 0.05 / (n - 1); \
				printf "{%.17g, %.17g},\n", below, (i + 2 < n ? sum : 1) - below } }' $< > $@.part && mv $@.part $@

# For each of WAVELENGTH_GUIDE equal parts of [0,1), the cell in which it begins.
$(BUILD)/gen/wavelength_guide.inc: $(BUILD)/gen/wavelength_cells.inc
	awk -F'[{,]' '{ below[n++] = $$2 } \
		END { for (k = 0; k < 512; k++) { \
				while (cell + 1 < n && below[cell + 1] <= k / 512) cell++; \
				printf "%d,\n", cell } }' $< > $@.part && mv $@.part $@

$(BUILD)/gen/conductors.inc: worker/render/bsdf/data/conductors.csv
	@mkdir -p $(@D)
	awk -F, '!/^#/ { if ($$1 != name) printf "%s{\"%s\", {\n", (name != "" ? "}},\n" : ""), $$1; name = $$1; \
		printf "{%s, %s, %s},\n", $$2, $$3, $$4 } END { print "}}," }' $< > $@.part && mv $@.part $@

# The generator is compiled for the build host, without sanitizers: it runs once, for seconds.
UPSAMPLE_GEN_SRC := worker/render/texture/upsample_gen.c worker/render/texture/upsample.c worker/render/math/cie.c
$(BUILD)/gen/upsample_gen: $(UPSAMPLE_GEN_SRC) worker/render/texture/upsample.h worker/render/math/cie.h \
		$(BUILD)/gen/cie_observer.inc $(BUILD)/gen/cie_d65.inc $(BUILD)/gen/wavelength_guide.inc
	@mkdir -p $(@D)
	$(CC) -D_GNU_SOURCE -I. -I$(BUILD)/gen -std=c17 -O2 -ffp-contract=off $(WARN) $(UPSAMPLE_GEN_SRC) -o $@ -lm

$(BUILD)/gen/upsample_table.inc: $(BUILD)/gen/upsample_gen
	$< > $@.part && mv $@.part $@
