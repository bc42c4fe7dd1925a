# SPDX-License-Identifier: Apache-2.0
# Container images in deploy/ are tagged with the programs' version (common/base/version.h): the programs of a farm must be of one
# version, and a cluster that has an image does not fetch another of the same tag.
cd "$(dirname "$0")/../.." || exit 1
version=$(sed -n 's/^#define HSLT_VERSION "\(.*\)"$/\1/p' common/base/version.h)
tags=$(grep -rnoE '^ +image: [^ ]*|hslt-farm:[0-9][^ ]*' deploy)
wrong=$(printf '%s\n' "$tags" | grep -vE ":( +image: )?hslt-farm:$(printf %s "$version" | sed 's/[.+]/\\&/g')$")
if [ -z "$version" ] || [ -z "$tags" ] || [ -n "$wrong" ]; then
	echo "WRONG: images whose tag is not the version $version"
	printf '%s\n' "$wrong"
	exit 1
fi
echo "ok: images are tagged $version"
