#!/bin/sh
# pip_install.sh SOURCE FOLDER BUNDLE BUNDLE_WITH_MOTIONS BUNDLE_WITH_CORRIDOR BUNDLE_TO_CUT PYTHON: installs the package with pip from the source tree into a new environment, without a
# package index, and runs the package's tests. numpy is the system's.
set -eu
source=$1 folder=$2 bundle=$3 moved=$4 pierced=$5 divided=$6 python=$7
rm -rf "$folder"
mkdir -p "$folder"
"$python" -m venv --system-site-packages "$folder/venv"
cd "$folder"
unset PYTHONPATH
export MPLBACKEND=Agg
venv/bin/pip install --no-index --no-cache-dir --disable-pip-version-check "$source/bindings/python"
venv/bin/python -c "import palpate, sys; assert palpate.__file__.startswith(sys.prefix), palpate.__file__"
venv/bin/pip show --files palpate | grep -q 'palpate/py.typed'
venv/bin/python "$source/tests/embed/example.py" "$bundle"
venv/bin/python "$source/tests/embed/python_test.py" "$bundle" "$source" "$moved" "$pierced" "$divided"
venv/bin/pip uninstall --yes palpate
if venv/bin/python -c "import palpate" 2>/dev/null; then exit 1; fi
