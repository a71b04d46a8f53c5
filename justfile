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
