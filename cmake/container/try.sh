#!/bin/bash
# try.sh SOURCE ROOT [CCACHE_FOLDER]: does in ROOT, a new Debian 12, what the recipes of this folder do, without a daemon: the base image is made
# by mmdebstrap. Then an ordinary user computes and plays an organ there, and one of a folder of images as a job of a cluster does it, and builds
# the programs once more without root. Needs root.
set -euo pipefail
source=$(realpath "$1") root=$(realpath -m "$2") cache=${3:+$(realpath "$3")}
rm -rf "$root"
trap 'rm -rf "$root"' EXIT
mapfile -t lists < <(find /etc/apt -name sources.list -o -path '*/sources.list.d/*.list' -o -path '*/sources.list.d/*.sources')
# In mounts of its own: were it killed, the trap must not find the machine's /proc and /sys below ROOT.
unshare --mount mmdebstrap --quiet --variant=minbase --mode=root --dpkgopt=force-unsafe-io --include=ca-certificates bookworm "$root" "${lists[@]}"
cp /etc/resolv.conf "$root/etc/"
mkdir -p "$root/opt/palpate" "$root/ccache"
git -C "$source" archive HEAD | tar -x -C "$root/opt/palpate"
# With /proc and the compiler's cache, mounted for that command alone.
inside() {
  unshare --mount /bin/bash -euc 'mount -t proc proc "$0/proc"; [ -z "$2" ] || mount --bind "$2" "$0/ccache"
    exec chroot "$0" env CCACHE_DIR=/ccache CMAKE_FLAGS="${CMAKE_FLAGS-}" HWLOC_COMPONENTS=-gl /bin/bash -euo pipefail -c "$1"' "$root" "$1" "$cache"
}
inside '/opt/palpate/cmake/container/install.sh'
as_user='setpriv --reuid 1000 --regid 1000 --clear-groups env HOME=/home/user CCACHE_READONLY=1 CCACHE_TEMPDIR=/tmp'
inside "mkdir /home/user && cp -r /opt/palpate /home/user/ && chown -R 1000:1000 /home/user
  cd /home/user/palpate
  $as_user make -f pipelines/built.mk BIN=/usr/local/bin ORGAN=plate PICTURES=
  test -s data/plate/5mm/corners/scenes/one-contact/summary.json
  $as_user python3 tests/support/labelled_image.py scan.nii.gz
  $as_user env BIN=/usr/local/bin RESOLUTION=coarse pipelines/slurm/organs_of_images.sh 3 scan.nii.gz > /tmp/cases
  $as_user env BIN=/usr/local/bin LAUNCH= RANKS=1 SLURM_SUBMIT_DIR=. SLURM_ARRAY_TASK_ID=1 pipelines/slurm/organ.sbatch /tmp/cases
  test -s data/scan/coarse/held/bundle.h5
  $as_user make -f Makefile.data build/build.ninja
  $as_user cmake --build build --target palpate-run
  build/bin/palpate-run --version"
echo "the container's steps work in a new Debian, and an ordinary user builds without apt"
