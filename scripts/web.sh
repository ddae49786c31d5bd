#!/usr/bin/env bash
# Builds the packages for browsers, and has them say of buildings what the native run time says: in node, and in Chromium as pixels.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-$PWD/target}
# What `just test-full` has built is taken as it is.
[ -x "$target/release/enfilade" ] || cargo build --release --locked -q -p enfilade-cli --features full
[ -x "$target/release/examples/frames" ] || cargo build --release --locked -q -p enfilade-web --example frames
cd web
npm ci --ignore-scripts --no-audit --no-fund --silent
node build.mjs
npm run --silent check
npm run --silent test
