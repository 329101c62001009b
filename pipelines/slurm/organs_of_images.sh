#!/bin/bash
# organs_of_images.sh LABEL IMAGE...: makes the folder of a new organ of each image, or of each in a folder, named as the image's file, and prints for each a line that
# organ.sbatch takes. Folders of an earlier run stay as they are. From the project's root:
#
#   pipelines/slurm/organs_of_images.sh 1 images/*.nii.gz > cases
#   sbatch --array=1-$(wc -l < cases) --ntasks-per-node=1 --mem=2G --time=0:10:00 pipelines/slurm/organ.sbatch cases
#
# Taken from the environment: RESOLUTION (medium; also coarse, fine), ORGANS_DIR (pipelines), BIN (build/bin).
set -euo pipefail
fail() { echo "organs_of_images.sh: $1" >&2; exit 2; }
[ $# -ge 2 ] || fail "expected LABEL IMAGE..., found '$*'"
label=$1 folder=$(realpath -m "${ORGANS_DIR:-pipelines}")
[[ $folder != *[[:blank:]]* ]] || fail "$folder: expected a path without blanks, which end a word of a line of cases"
shift
images=()
for given in "$@"; do
  if [ -d "$given" ]; then
    mapfile -d '' -t -O ${#images[@]} images < <(find "$given" -maxdepth 1 -type f -regextype posix-extended \
      -regex '.*\.(nii|nii\.gz|nrrd|nhdr|mha|mhd|inr|inr\.gz)' -print0 | sort -z)
  else
    images+=("$given")
  fi
done
[ ${#images[@]} -gt 0 ] || fail "$*: expected images (.nii .nii.gz .nrrd .nhdr .mha .mhd .inr .inr.gz), found none"
for image in "${images[@]}"; do
  image=$(realpath "$image") name=$(basename "$image" .gz)
  name=${name%.*} name=${name//[^A-Za-z0-9_-]/-}
  if ! [ -e "$folder/$name" ]; then
    "${BIN:-build/bin}/palpate-organ" --quiet --image "$image" --label "$label" --name "$name" --folder "$folder" > /dev/null
  fi
  grep -qxF "IMAGE ?= $image" "$folder/$name/organ.mk" || fail "$image: $folder/$name is the folder of another image; rename one of them"
  echo "$name held ${RESOLUTION:-medium} ORGANS_DIR=$folder"
done
