#!/usr/bin/env bash
# Drives the laboratory's page in a headless Chromium. Screenshots of every view: target/lab-screenshots. Where there is no Chromium or no
# node it says so and is content; `make test-lab` installs them first.
set -euo pipefail
cd "$(dirname "$0")"

skip() { printf '\n  lab page: skipped: %s (make test-lab installs what it needs)\n\n' "$1" >&2; exit 0; }

for name in "${CHROMIUM:-}" chromium chromium-browser google-chrome; do
  [ -n "$name" ] && CHROMIUM=$(command -v "$name") && break || CHROMIUM=
done
[ -n "$CHROMIUM" ] || skip "no chromium"
command -v node >/dev/null || skip "no node"
node -e 'process.exit(process.versions.node.split(".")[0] >= 20 ? 0 : 1)' || skip "node $(node --version) is older than 20"
[ -x ../../target/release/misclosure ] || [ -n "${MISCLOSURE:-}" ] || { echo "lab page: no target/release/misclosure: make build" >&2; exit 1; }
if ! [ -d node_modules/playwright-core ]; then
  command -v npm >/dev/null || skip "no npm"
  npm ci --no-audit --no-fund >/dev/null || skip "npm ci failed (no network?)"
fi
export CHROMIUM
node --test --test-concurrency=2 "$@"
