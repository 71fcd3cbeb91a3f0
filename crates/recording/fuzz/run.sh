#!/usr/bin/env bash
# Fuzzes every target, one after the other: `crates/recording/fuzz/run.sh [SECONDS_A_TARGET [TARGET..]]`.
# Needs cargo-fuzz (`cargo install cargo-fuzz`); findings are in artifacts/TARGET/. docs/hardening.md says more.
set -euo pipefail
cd "$(dirname "$0")"
seconds="${1:-600}"
targets=("${@:2}")
[ ${#targets[@]} -gt 0 ] || targets=(recording records message pipeline geometry results)

# The versions that the product is built with; without a sanitizer, stable Rust will do.
[ -f Cargo.lock ] || cp ../../../Cargo.lock Cargo.lock
build=(--sanitizer none --features files)
triple="$(rustc -vV | sed -n 's/^host: //p')"
cargo fuzz build "${build[@]}"
"target/$triple/release/seeds" -runs=0

for target in "${targets[@]}"; do
    echo "== $target, $seconds s"
    mkdir -p "corpus/$target" "artifacts/$target" "regressions/$target"
    nice -n 15 "target/$triple/release/$target" "corpus/$target" "regressions/$target" \
        -max_total_time="$seconds" -max_len=16384 -rss_limit_mb=2048 -timeout=20 \
        -print_final_stats=1 -artifact_prefix="artifacts/$target/"
done
