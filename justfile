# What CI runs, one recipe a step; `just ci` is all of it.

export ENFILADE_DATA := env("ENFILADE_DATA", justfile_directory() / "../shared/data")

# Everything, in CI's order.
ci: fmt clippy doc features readme test-full viewer bevy guides package

fmt:
    cargo fmt --all -- --check

clippy:
    cargo clippy --workspace --all-targets -- -D warnings
    cargo clippy --all-targets --features full -- -D warnings

doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --workspace

# The README's own test command: the short tests.
test:
    cargo test

# Each feature alone: that it builds, without a warning where there is no builder, and what it costs.
features:
    cargo clippy --no-default-features --lib -- -D warnings
    cargo clippy --no-default-features --features gpu,simd --lib -- -D warnings
    cargo clippy --no-default-features --features bake --lib -- -D warnings
    bash scripts/features.sh

# Every test and every format, on the real buildings of $ENFILADE_DATA.
test-full:
    cargo test --release --features full

# The viewer: frames on a software driver, and a window on a display of its own. Optimised, since the library is slow otherwise.
viewer:
    cargo test --release -p enfilade-viewer --features enfilade/full
    if pkg-config --exists libudev; then cargo clippy -p enfilade-viewer --features gamepad -- -D warnings; \
        else echo "not checked: the feature gamepad: no libudev-dev"; fi

# The plugin for Bevy, without a window.
bevy:
    cargo test --profile plain -p bevy_enfilade

# The README's commands, as written there, its tests among them.
readme:
    bash scripts/readme-commands.sh

# The guides' commands, as written there.
guides:
    bash scripts/guides.sh

# What would be published: it must be complete, and small.
package:
    cargo package --locked --allow-dirty --no-verify -p enfilade

# The long part: ten million rays on every real building, every frame's pixels. Writes out/torture.
torture:
    bash scripts/torture.sh

# One reader under libFuzzer (nightly, cargo-fuzz): `just fuzz pvs -max_total_time=600`.
fuzz TARGET *FLAGS:
    cargo +nightly fuzz run {{TARGET}} -- {{FLAGS}}
