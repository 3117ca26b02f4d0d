#!/bin/sh
# The package as an index has it: its wheels, installed with fenwear[solver,verify] into an environment of its own that sees
# nothing of this system's packages, and tests/smoke.py with it, from an empty cache. Called by `docker/fenwear test
# --wheel`; needs PyPI.
set -eu
checkout=$1
unset PYTHONPATH
folder=$(mktemp -d "${XDG_CACHE_HOME:-/tmp}/fenwear-wheel-XXXXXX")
trap 'rm -rf "$folder"' EXIT
trap 'exit 130' INT TERM

python3 -m pip wheel --quiet --no-deps --no-build-isolation --no-index --wheel-dir "$folder" "$checkout"
python3 -m pip wheel --quiet --no-deps --no-build-isolation --no-index --wheel-dir "$folder" "$checkout/tests/verification"
wheel=$(echo "$folder"/fenwear-*.whl)
echo "$(basename "$wheel"): $(($(stat -c %s "$wheel") / 1024)) KiB"

python3 -m venv --without-pip "$folder/venv"
begin=$(date +%s)
if ! python3 -m pip --python "$folder/venv/bin/python" install --quiet --disable-pip-version-check \
    --find-links "$folder" "$wheel[solver,verify]"; then
    echo "fenwear: fenwear[solver] cannot be installed: is PyPI reached from here?" >&2
    exit 1
fi
echo "installed in $(($(date +%s) - begin)) s, $(du -sm "$folder/venv" | cut -f 1) MB"

cd "$folder"
PATH=$folder/venv/bin:$PATH XDG_CACHE_HOME=$folder/cache MPLCONFIGDIR=$folder/cache \
    "$folder/venv/bin/python" "$checkout/tests/smoke.py" "$folder/runs"

# Programs that fenwear works with, where pip installs them. The wheel of Tamaas 2.9 for Python 3.13 lacks its module.
python3 -m pip --python "$folder/venv/bin/python" install --quiet --disable-pip-version-check \
    umbridge openturns SurfaceTopography tamaas distributed pytest hypothesis
PATH=$folder/venv/bin:$PATH XDG_CACHE_HOME=$folder/cache MPLCONFIGDIR=$folder/cache \
    "$folder/venv/bin/python" -m pytest --quiet -p no:cacheprovider "$checkout/tests/test_other_programs.py" \
    "$checkout/tests/contact/test_grid_contact.py::test_pressures_are_those_of_tamaas"
