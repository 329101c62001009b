#!/bin/bash
# extract-image.sh OUTPUT: CGAL's segmented liver, from the data archive of Debian's package libcgal-demo.
set -euo pipefail
output=$1
archive=/usr/share/doc/libcgal-dev/data.tar.gz
member=data/images/liver.inr.gz
sha256=8d585a21aaaa34ab62219fa3606541b73de22e25211f78180c625df341cc1991

if [ ! -r "$archive" ]; then
  # A dpkg path-exclude of /usr/share/doc (as in container images) drops the archive from an installed package.
  echo "note: $archive is not on this machine; downloading the package libcgal-demo for it (24 MB)" >&2
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
  chmod 755 "$folder" # apt's own user writes there
  (cd "$folder" && apt-get download libcgal-demo >&2)
  dpkg-deb --fsys-tarfile "$folder"/libcgal-demo_*.deb | tar -xO -f - ".$archive" > "$folder/data.tar.gz"
  archive=$folder/data.tar.gz
fi

tar -xzO -f "$archive" "$member" > "$output.part"
if ! echo "$sha256  $output.part" | sha256sum --check --status; then
  rm -f "$output.part"
  echo "extract-image.sh: $archive: $member is not the image that pipelines/liver was written for (SHA-256 $sha256)" >&2
  exit 2
fi
mv "$output.part" "$output"
