#!/bin/bash
# try_packages.sh SOURCE PACKAGES ROOT: installs the packages in ROOT, a new Debian 12 that has nothing else, and uses each of them: an
# organ from its geometry to a played scene, a program in C against the library, the wheel in Python, the npm package in Node,
# the package for Unity under mono. Needs root.
set -euo pipefail
source=$1 packages=$2 root=$3
rm -rf "$root"
trap 'rm -rf "$root"' EXIT
# The machine's own lists of Debian packages.
mapfile -t lists < <(find /etc/apt -name sources.list -o -path '*/sources.list.d/*.list' -o -path '*/sources.list.d/*.sources')
# In mounts of its own: were it killed, the trap must not find the machine's /proc and /sys below ROOT.
unshare --mount mmdebstrap --quiet --variant=minbase --mode=root \
  --include=gcc,libc6-dev,pkg-config,mono-mcs,mono-runtime,nodejs,python3-numpy,python3-venv,python3-pip bookworm "$root" "${lists[@]}"

mkdir "$root/try"
cp "$packages"/*.deb "$packages"/*.whl "$packages"/*.tgz "$root/try/"
cp -r "$source/pipelines/plate" "$source/tests/embed/example.c" "$source/tests/embed/example.py" \
  "$source/tests/embed/csharp/Example.cs" \
  "$source/cmake/binary-packages/example.mjs" "$root/try/"
cp /etc/resolv.conf "$root/etc/"
# With /proc, mounted for that command alone.
inside() { unshare --mount /bin/bash -euc 'mount -t proc proc "$0/proc" && exec chroot "$0" /bin/bash -euo pipefail -c "$1"' "$root" "$1"; }

inside 'apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends /try/*.deb > /try/apt.log'
inside 'cd /try && palpate-tetrahedra plate/plate.geo -o mesh.msh --set edge=10 --set layers=2 --quiet &&
        HWLOC_COMPONENTS=-gl palpate-precompute mesh.msh --organ plate/organ.toml --boundary plate/boundary/corners.toml -o bundle.h5 --quiet &&
        palpate-run plate/scenes/one-contact.toml --bundle bundle.h5 -o played --quiet && test -s played/summary.json'
inside 'cd /try && cc -std=c99 example.c -o example $(pkg-config --cflags --libs palpate) && ./example bundle.h5'
inside 'cd /try && python3 -m venv --system-site-packages venv && venv/bin/pip install --quiet --no-index *.whl &&
        venv/bin/python example.py bundle.h5 | tail -n 1'
inside 'cd /try && mkdir -p node_modules/palpate && tar -xzf palpate-*.tgz -C node_modules/palpate --strip-components=1 &&
        node example.mjs bundle.h5'
inside 'cd /try && tar -xzf com.palpate.runtime-*.tgz && mcs -unsafe -out:example.exe Example.cs package/Runtime/*.cs &&
        test -s package/Plugins/x86_64/palpate.dll && LD_LIBRARY_PATH=package/Plugins/x86_64 mono example.exe bundle.h5 | tail -n 1'
# Nothing is left when the packages are removed.
inside 'dpkg --purge palpate libpalpate-dev $(dpkg-query -W -f "\${Package} " "libpalpate[0-9]*") > /dev/null && ! find /usr -name "*palpate*" | grep .'
echo "the packages work in a new Debian"
