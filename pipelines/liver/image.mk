# The default organ's image, from Debian's package libcgal-demo; other organs of the same image include this file.
LIVER_IMAGE := $(DATA)/liver/liver.inr.gz
$(LIVER_IMAGE): $(PIPELINES)/liver/extract-image.sh
	mkdir -p $(@D)
	$< $@
