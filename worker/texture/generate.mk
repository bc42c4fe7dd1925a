# Tables that are made at build time: published data as C initialisers, and the coefficients of upsampled colours.
TABLES := $(addprefix $(BUILD)/gen/,cie_observer.inc cie_d65.inc conductors.inc upsample_table.inc)
generated: $(TABLES)

$(BUILD)/gen/cie_observer.inc: worker/math/data/cie1931_2deg_1nm.csv
	@mkdir -p $(@D)
	awk -F, '!/^#/ { printf "{%s, %s, %s},\n", $$2, $$3, $$4 }' $< > $@.part && mv $@.part $@

$(BUILD)/gen/cie_d65.inc: worker/math/data/cie_d65_1nm.csv
	@mkdir -p $(@D)
	awk -F, '!/^#/ { printf "%s,\n", $$2 }' $< > $@.part && mv $@.part $@

$(BUILD)/gen/conductors.inc: worker/bsdf/data/conductors.csv
	@mkdir -p $(@D)
	awk -F, '!/^#/ { if ($$1 != name) printf "%s{\"%s\", {\n", (name != "" ? "}},\n" : ""), $$1; name = $$1; \
		printf "{%s, %s, %s},\n", $$2, $$3, $$4 } END { print "}}," }' $< > $@.part && mv $@.part $@

# The generator is a program of this machine without sanitizers: it runs for seconds, once.
UPSAMPLE_GEN_SRC := worker/texture/upsample_gen.c worker/texture/upsample.c worker/math/cie.c
$(BUILD)/gen/upsample_gen: $(UPSAMPLE_GEN_SRC) worker/texture/upsample.h worker/math/cie.h \
		$(BUILD)/gen/cie_observer.inc $(BUILD)/gen/cie_d65.inc
	@mkdir -p $(@D)
	$(CC) -D_GNU_SOURCE -I. -I$(BUILD)/gen -std=c17 -O2 -ffp-contract=off $(WARN) $(UPSAMPLE_GEN_SRC) -o $@ -lm

$(BUILD)/gen/upsample_table.inc: $(BUILD)/gen/upsample_gen
	$< > $@.part && mv $@.part $@
