#!/usr/bin/env bash
# Fuzzes every target, one after the other: `crates/recording/fuzz/run.sh [SECONDS_A_TARGET [TARGET..]]`; with `minimise` in the place
# of the seconds, what they found to reach anything new goes into corpus/TARGET, which the tests replay.
# Needs cargo-fuzz (`cargo install cargo-fuzz`); findings are in artifacts/TARGET/. docs/hardening.md says more.
set -euo pipefail
cd "$(dirname "$0")"
seconds="${1:-600}"
targets=("${@:2}")
[ ${#targets[@]} -gt 0 ] || targets=(recording records bag message pipeline geometry results)

# The versions that the product is built with; without a sanitizer, stable Rust will do.
[ -f Cargo.lock ] || cp ../../../Cargo.lock Cargo.lock
build=(--sanitizer none --features files)
# What is copied on the way is read once: in memory, where the machine has room for it there.
[ ! -d /dev/shm ] || export TMPDIR=/dev/shm
triple="$(rustc -vV | sed -n 's/^host: //p')"
cargo fuzz build "${build[@]}"
"target/$triple/release/seeds" -runs=0

for target in "${targets[@]}"; do
    echo "== $target, $seconds"
    mkdir -p "grown/$target" "corpus/$target" "artifacts/$target" "regressions/$target"
    if [ "$seconds" = minimise ]; then
        rm -rf "grown/$target.least"
        mkdir "grown/$target.least"
        "target/$triple/release/$target" -set_cover_merge=1 -max_len=16384 "grown/$target.least" "corpus/$target" "grown/$target"
        # Up to 250 of them and 80 kB of each target, drawn by their names, which are hashes: they are kept in the repository, and
        # replayed by every run of the tests.
        rm -r "corpus/$target"
        mkdir "corpus/$target"
        find "grown/$target.least" -type f -printf '%f %s %p\n' | sort |
            awk '$2 <= 80000 - sum && n < 250 { sum += $2; n++; print $3 }' | xargs -r cp -t "corpus/$target"
        continue
    fi
    nice -n 15 "target/$triple/release/$target" "grown/$target" "corpus/$target" "regressions/$target" \
        -max_total_time="$seconds" -max_len=16384 -rss_limit_mb=2048 -timeout=20 \
        -print_final_stats=1 -artifact_prefix="artifacts/$target/"
done
