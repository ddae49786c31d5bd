# What CI runs, one recipe a step; `just ci` is all of it.

full := "--release --workspace --exclude bevy_enfilade --exclude enfilade-studies --features enfilade-cli/full"

export ENFILADE_DATA := env("ENFILADE_DATA", justfile_directory() / "../shared/data")

# Everything, in CI's order.
ci: fmt clippy doc features readme test-full c web bevy guides package

fmt:
    cargo fmt --all -- --check

# Of all members at once: features that differ would check every crate that they reach anew.
clippy:
    if pkg-config --exists libudev; then gamepad=,enfilade-viewer/gamepad; \
        else gamepad=; echo "not checked: the feature gamepad: no libudev-dev"; fi; \
    cargo clippy --workspace --all-targets --features enfilade-cli/full$gamepad -- -D warnings
    cargo clippy -- -D warnings

doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --workspace --features enfilade-cli/full

# The README's own test command: the short tests.
test:
    cargo test

# Each feature alone: that it builds, without a warning where there is no builder, and what it costs.
features:
    cargo clippy -p enfilade --no-default-features --lib -- -D warnings
    cargo clippy -p enfilade --no-default-features --features gpu,simd --lib -- -D warnings
    cargo clippy -p enfilade-terrain --no-default-features --lib -- -D warnings
    bash scripts/features.sh

# Every test and every format, on the real buildings of $ENFILADE_DATA; the viewer's frames on a software driver, and its window on a display
# of its own. Both in one build; optimised, since the library is slow otherwise.
test-full:
    cargo test {{ full }}

# What `test-full` runs.
build-full:
    cargo test {{ full }} --no-run

# The library for C: its programs say what Rust says, under AddressSanitizer and valgrind.
c:
    bash scripts/c.sh

# The run time for browsers, and what is made of it: built, typed, and tested in node and in Chromium against the native run time.
web:
    bash scripts/web.sh

# The plugin for Bevy, without a window.
bevy:
    cargo test --profile plain -p bevy_enfilade

# The README's commands, as written there, its tests among them; the viewer draws a picture in place of its window.
readme:
    bash scripts/readme-commands.sh

# The guides' commands, as written there.
guides:
    bash scripts/guides.sh

# What would be published: it must be complete, and small.
package:
    cargo package --locked --allow-dirty --no-verify -p enfilade -p enfilade-tubes

# The long part: ten million rays on every real building, every frame's pixels. Writes out/torture.
torture:
    bash scripts/torture.sh

# One reader under libFuzzer (nightly, cargo-fuzz): `just fuzz pvs -max_total_time=600`.
fuzz TARGET *FLAGS:
    cargo +nightly fuzz run {{TARGET}} -- {{FLAGS}}
