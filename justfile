# All recipes run from the repository's root.

# The tests.
test:
    cargo test

# What the continuous integration runs.
ci:
    .ci/run

# Criterion benchmarks.
bench *ARGS:
    cargo bench {{ARGS}}

# Repairs every model below a folder and prints a row for each.
sweep MODELS OUT *ARGS:
    cargo build --release
    scripts/sweep.py {{MODELS}} {{OUT}} {{ARGS}}

# Estimates and repairs every model below a folder and compares the two.
check-estimate MODELS *ARGS:
    cargo build --release
    scripts/check_estimate.py {{MODELS}} {{ARGS}}

# Writes testdata/ anew.
testdata:
    scripts/make_testdata.py

# Licences and advisories of the dependencies.
deny:
    cargo deny check

# Kills a repair at random moments and checks what comes of it.
soak *ARGS:
    cargo build --release
    scripts/soak_kills.py {{ARGS}}

# Fuzzes a target of fuzz/ for some seconds; needs cargo-fuzz.
fuzz TARGET SECONDS="60":
    RUSTC_BOOTSTRAP=1 cargo fuzz run {{TARGET}} fuzz/corpus/{{TARGET}} testdata/fuzz/{{TARGET}} -- -max_total_time={{SECONDS}}

# Compares estimates with what repairs take.
estimates *ARGS:
    cargo build --release
    scripts/check_estimate.py {{ARGS}}

# Measures brickmend beside its peers; needs an interpreter with bpy, and vdb_tool.
bench-peers MESH *ARGS:
    cargo build --release
    scripts/bench_peers.py {{MESH}} {{ARGS}}

# Repairs every model at every clustering threshold and writes tables.
quality MODELS OUT *ARGS:
    cargo build --release
    scripts/quality.py {{MODELS}} {{OUT}} {{ARGS}}
