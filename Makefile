# Every target does the set-up it needs (scripts/setup.sh). All builds are --release: one build serves tests, demo and benchmarks.

export PATH := $(or $(CARGO_HOME),$(HOME)/.cargo)/bin:$(PATH)

.PHONY: help setup build test clean
.DEFAULT_GOAL := help

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1 \t\2/p' $(MAKEFILE_LIST) | expand -t 22

setup: ## install what is missing (Debian, Ubuntu) or list it (elsewhere)
	@scripts/setup.sh

build: setup ## build the program: target/release/misclosure
	cargo build --release

test: setup ## everything CI runs: format, lints, documentation, tests
	cargo fmt --check
	cargo clippy --release --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps
	cargo test --release

clean: ## remove everything that was built
	cargo clean
