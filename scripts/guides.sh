#!/usr/bin/env bash
# Runs the commands of the three guides as written there: each of their ```sh blocks, in order, with the release build. Builds their
# programs, and the README's, as a stranger does: outside the workspace, with the dependencies that the page names, without a lock file.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release
# The guides name the binary where cargo puts it unless told otherwise.
built=${CARGO_TARGET_DIR:-target}
[ "$built" = target ] || { mkdir -p target/release && ln -sf "$(realpath "$built")/release/enfilade" target/release/enfilade; }
for guide in docs/guide-*.md; do
  echo "+ $guide"
  awk '/^```sh/{on=1;next} /^```/{on=0} on' "$guide" | bash -euo pipefail >/dev/null
done

guides=$(mkdir -p "$built/guides" && realpath "$built/guides")
stranger=$(mktemp -d)
trap 'rm -rf "$stranger"' EXIT
programs=0
for page in README.md docs/guide-*.md; do
  # A program is a ```rust block, with the dependencies of the ```toml block before it, if there is one. A block without a main is put
  # into one, and lines that only the documentation's tests see (`# `) count.
  awk -v to="$stranger/$(basename "$page" .md)" '
    /^```toml/ { kind = "toml"; manifest = ""; next }
    /^```rust/ { kind = "rust"; program = ""; next }
    /^```/ && kind == "rust" {
      crate = to "-" ++count
      system("mkdir -p \"" crate "/src\"")
      if (manifest == "") manifest = "[dependencies]\nenfilade = { version = \"0.1\", default-features = false }\n"
      printf "[package]\nname = \"program\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n%s\n[workspace]\n", manifest > (crate "/Cargo.toml")
      if (program !~ /fn main/) program = "fn main() -> Result<(), Box<dyn std::error::Error>> {\n" program "}\n"
      printf "%s", program > (crate "/src/main.rs")
    }
    /^```/ { kind = ""; next }
    kind == "toml" { manifest = manifest $0 "\n" }
    kind == "rust" { sub(/^# /, ""); program = program $0 "\n" }
  ' "$page"
done
for crate in "$stranger"/*/; do
  echo "+ the program $(basename "$crate")"
  # What the registry will have under this version lies here.
  sed -i "s|^enfilade = { version = \"[^\"]*\"|enfilade = { path = \"$PWD\"|" "$crate/Cargo.toml"
  grep -q "path = \"$PWD\"" "$crate/Cargo.toml"
  (cd "$crate" && CARGO_TARGET_DIR="$guides" cargo build --quiet)
  programs=$((programs + 1))
done
[ "$programs" -ge 2 ] || { echo "only $programs programs found: this builds nothing" >&2; exit 1; }
