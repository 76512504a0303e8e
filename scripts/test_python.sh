#!/usr/bin/env bash
# Tests the Python package in a virtual environment under target/python: `test_python.sh WHEEL` installs a wheel into a
# new one, `test_python.sh built` the library that cargo has built for the other tests into one that is kept
# (`test_python.sh prepared` only makes that one). Words after that go to pytest; `pages` writes the notebooks' pages of the book instead (`make notebooks`). Without Python or PyPI it says so and leaves the tests out.
set -euo pipefail
cd "$(dirname "$0")/.."
what=$1
shift

skipped() {
  printf '\n  Python package: skipped: %s\n\n' "$1" >&2
  exit 0
}

python3 -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 9))' 2>/dev/null ||
  skipped "no python3 of version 3.9 with venv (apt-get install python3-venv)"
# What the tests need stands once, in the package's own list.
needed=$(python3 - <<'END'
import re
text = open("python/pyproject.toml").read()
print(" ".join(re.findall(r'"([^"]+)"', re.search(r"^test = \[(.*?)\]", text, re.S | re.M)[1])))
END
)
case $what in
built | prepared) place=target/python/kept ;;
*)
  place=target/python/clean
  rm -rf "$place"
  needed="$needed mypy"
  ;;
esac
[ -x "$place/bin/python" ] || python3 -m venv "$place"
# shellcheck disable=SC2086
"$place/bin/pip" --quiet --disable-pip-version-check install numpy $needed ||
  skipped "pip cannot install $needed (is PyPI out of reach?)"
[ "$what" != prepared ] || exit 0
if [ "$what" = built ]; then
  # As in scripts/test.sh: a module, which links no libpython.
  export PYO3_BUILD_EXTENSION_MODULE=1
  cargo build --release --workspace --features misclosure-py/ceres
  packages=$("$place/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
  rm -rf "$packages/misclosure"
  cp -r python/misclosure "$packages/"
  cp target/release/lib_native.so "$packages/misclosure/_native.abi3.so"
else
  "$place/bin/pip" --quiet --disable-pip-version-check install "$what"
fi
# From elsewhere: `import misclosure` has to find what was installed, not the sources beside the tests.
root=$PWD python=$PWD/$place/bin/python
mkdir -p target/python/work
cd target/python/work
export PYTHONDONTWRITEBYTECODE=1
if [ "${1:-}" = pages ]; then exec "$python" "$root/python/notebooks/pages.py" "$root/docs/notebooks"; fi
"$python" -m pytest -q -rs -p no:cacheprovider -n auto "$root/python/tests" "$@"
