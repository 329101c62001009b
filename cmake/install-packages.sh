#!/usr/bin/env bash
# Installs what is missing from a list of Debian packages (one a line, # for comments), as root or through sudo.
set -euo pipefail
list=$1
# One list at a time, because apt refuses a second run beside the first.
exec 9< "$0"
flock 9

mapfile -t wanted < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$list")
if ! command -v dpkg-query >/dev/null; then
  echo "$list: its packages are Debian's and this machine has no dpkg; install their equivalents by hand, then run make with PACKAGES=skip" >&2
  exit 1
fi
# What an installed package provides is there: a nodejs of another source brings npm along, and does not bear Debian's beside it.
provided=" $(dpkg-query -W -f '${db:Status-Status} ${Provides}\n' | sed -n -e 's/([^)]*)//g' -e 's/^installed //p' | tr -s ', \n' ' ') "
missing=()
for package in "${wanted[@]}"; do
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || [[ $provided == *" $package "* ]] ||
    missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

if [ "$(id -u)" -eq 0 ]; then
  as_root=(env)
elif command -v sudo >/dev/null; then
  as_root=(sudo env)
else
  echo "$list: ${#missing[@]} packages are missing and this user is neither root nor has sudo; ask an administrator to run: apt-get install --no-install-recommends ${missing[*]}" >&2
  exit 1
fi
echo "installing ${#missing[@]} Debian packages: ${missing[*]}"
"${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get update -q
"${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
