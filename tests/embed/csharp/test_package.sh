#!/bin/sh
# test_package.sh SOURCE LIBRARY FOLDER PALPATE_RUN BUNDLE PYTHON BUNDLE_TO_CUT: makes the package for Unity in FOLDER with LIBRARY, compiles it, its sample and
# PackageTest.cs with mono, and runs them.
set -eu
source=$1 library=$2 folder=$3 palpate_run=$4 bundle=$5 python=$6 divided=$7
here=$source/tests/embed/csharp
rm -rf "$folder"
mkdir -p "$folder"
"$python" "$source/bindings/csharp/make_package.py" "$source" "$folder" "$library"
package=$folder/package
# Each imported file has its .meta, and no guid is there twice.
find "$package" -mindepth 1 ! -path '*~*' ! -name '*.meta' | while read -r file; do test -s "$file.meta"; done
test -z "$(find "$package" -name '*.meta' -exec sed -n 's/^guid: //p' {} + | sort | uniq -d)"
tar -tzf "$folder"/com.palpate.runtime-*.tgz | grep -q '^package/package.json$'

"$palpate_run" "$here/push.toml" --bundle "$bundle" -o "$folder/played" --record "$folder/record.toml" --quiet
compile() { mcs -unsafe -langversion:7 -warnaserror "$@"; }
compile -target:library -out:"$folder/Palpate.Runtime.dll" "$package"/Runtime/*.cs
compile -target:library -out:"$folder/Sample.dll" -r:"$folder/Palpate.Runtime.dll" "$package"/Samples~/*/*.cs "$here/UnityStubs.cs"
compile -out:"$folder/PackageTest.exe" -r:"$folder/Palpate.Runtime.dll" -r:"$folder/Sample.dll" "$here/PackageTest.cs"
LD_LIBRARY_PATH=$package/Plugins/x86_64 mono "$folder/PackageTest.exe" "$bundle" "$folder/record.toml" "$source/runtime/abi_3.txt" "$divided"
# The example of the README.
compile -out:"$folder/Example.exe" -r:"$folder/Palpate.Runtime.dll" "$here/Example.cs"
LD_LIBRARY_PATH=$package/Plugins/x86_64 mono "$folder/Example.exe" "$bundle" | grep '^1000 ms  0\.[0-9]*[1-9]'
