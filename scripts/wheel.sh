#!/usr/bin/env bash
# The wheel of the Python package, target/wheels/misclosure-*.whl, for every Linux of 2018 or later (glibc 2.28): the
# native solver, Rust alone. maturin and the linker for the older C library come from PyPI into target/python/build.
set -euo pipefail
cd "$(dirname "$0")/.."
tools=target/python/build
[ -x $tools/bin/maturin ] || { python3 -m venv $tools && $tools/bin/pip --quiet install "maturin>=1.7,<2" ziglang; }
# maturin looks for Python beside itself; --zig finds the linker there.
PATH="$PWD/$tools/bin:$PATH" $tools/bin/maturin build --release --strip --zig --compatibility manylinux_2_28 \
  --target x86_64-unknown-linux-gnu --manifest-path python/Cargo.toml --out target/wheels "$@"
wheel=$(ls -t target/wheels/misclosure-*.whl | head -n 1)
size=$(stat -c %s "$wheel")
echo "$wheel: $((size / 1000)) kB"
if [ "$size" -ge 25000000 ]; then
  echo "error: the wheel has $size bytes; expected less than 25 MB" >&2
  exit 1
fi
