#!/bin/bash
# make_npm_package.sh SOURCE WEB OUT: the npm package as a folder, OUT: the module, the web component, both builds of the runtime, and
# the types. WEB: the folder of {simd,baseline}/palpate.wasm.
set -euo pipefail
source=$(realpath "$1") web=$(realpath "$2") out=$(realpath -m "$3")
version=$(sed -n 's/^project(palpate VERSION \([0-9.]*\).*/\1/p' "$source/CMakeLists.txt")
cd "$source/bindings/web"
PALPATE_WASM=$web PALPATE_PACKAGE=$out node_modules/.bin/vite build --config component.config.js --logLevel warn
cp module/*.js component/palpate-viewer.d.ts "$source/LICENSE" "$out/"
for file in package.json README.md; do sed "s/@VERSION@/$version/" "npm/$file.in" > "$out/$file"; done
# The module's types, from its comments.
node_modules/.bin/tsc "$out/palpate.js" --declaration --emitDeclarationOnly --allowJs --target es2022 --module esnext \
  --moduleResolution bundler --skipLibCheck --outDir "$out"
