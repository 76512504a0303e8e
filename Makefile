# Every target does the set-up it needs (scripts/setup.sh). All builds are --release: one build serves tests, demo and benchmarks.

export PATH := $(or $(CARGO_HOME),$(HOME)/.cargo)/bin:$(PATH)
export RUSTC_WORKSPACE_WRAPPER := $(CURDIR)/scripts/rustc.sh
# Tests and demos use the defaults of the program and ignore the user's config.toml.
export MISCLOSURE_CONFIG :=

.PHONY: help setup build install demo check docs pictures test test-sanitize test-hidden test-cases test-fresh test-null hit-rates test-blunders test-lab fuzz bench dist try-dist wheel test-python test-parquet notebooks clean
.DEFAULT_GOAL := help

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1 \t\2/p' $(MAKEFILE_LIST) | expand -t 22

setup: ## install what is missing (Debian, Ubuntu) or list it (elsewhere)
	@scripts/setup.sh

build: setup ## build the program: target/release/misclosure
	cargo build --release

install: build ## program, manual pages, completions, header, CMake package and pkg-config file: PREFIX=/usr/local
	scripts/install.sh "$(or $(PREFIX),/usr/local)"

demo: build ## what is missing in a block of the repository, in half a minute
	scripts/demo.sh

check: setup ## what to run before every commit: format, lints, unit tests
	cargo fmt --check
	cargo clippy --release --all-targets -- -D warnings
	cargo test --release --lib

docs: build ## the book: target/book/index.html, with a page for each effect of the catalogue
	command -v mdbook >/dev/null || cargo install --locked mdbook
	target/release/misclosure --quiet effects book docs/effects
	mdbook build docs

pictures: build ## the pictures of README and book, from runs on blocks of the repository (some minutes; the gallery needs a Chromium)
	scripts/readme_picture.sh
	scripts/effect_pictures.sh
	scripts/gallery.sh
	cargo run --release --example how_it_decides
	cargo run --release --example planning_shapes

test: setup ## everything CI runs: format, lints, documentation, Rust and C++ tests, the laboratory's page where a Chromium is at hand
	scripts/test.sh

# Not optimised: the compiler takes two thirds of the time, and leaves no undefined behaviour out before it is seen.
test-sanitize: setup ## the C++ tests under AddressSanitizer, UBSan and the standard library's assertions
	cmake -S cpp -B target/cpp-sanitize -DCMAKE_BUILD_TYPE=Sanitize \
		-DCMAKE_CXX_FLAGS_SANITIZE="-O0 -g1 -fsanitize=address,undefined -fno-sanitize-recover=all -D_GLIBCXX_ASSERTIONS"
	cmake --build target/cpp-sanitize --target cpp_tests --parallel 2
	ctest --test-dir target/cpp-sanitize --output-on-failure

test-hidden: setup ## judge every block with a hidden effect (make test: a part of them)
	MISCLOSURE_HIDDEN=all cargo test --release --test diagnosis hidden::

test-cases: setup ## judge the labelled blocks of ../shared/cases (make test: six of them)
	MISCLOSURE_CASES=all cargo test --release --test diagnosis cases:: -- --nocapture

test-fresh: setup ## judge blocks drawn at random: SEEDS=1..40 (make test: four of them)
	MISCLOSURE_FRESH=$(SEEDS) cargo test --release --test diagnosis fresh:: -- --nocapture

test-null: setup ## p-values over many blocks without any cause: BLOCKS=200 (make test: a few)
	MISCLOSURE_NULL_BLOCKS=$(or $(BLOCKS),200) cargo test --release --test diagnosis -- check_points:: residuals:: --nocapture

hit-rates: setup ## how often the diagnosis is right, by kind of block and size of effect, on seeds that nobody looked at: SEEDS=1001..1040; and how many mistakes of people are named
	MISCLOSURE_FRESH=$(or $(SEEDS),1001..1040) cargo test --release --test diagnosis improve_finds_what_nobody_chose -- --nocapture
	cargo run --release --example mistake_rates -- $(or $(MISTAKE_SEEDS),1..3)

test-blunders: setup ## blunders of every size at the worst places, on every preset (make test: a handful)
	MISCLOSURE_BLUNDERS=all cargo test --release --test diagnosis blunders:: -- --nocapture

test-lab: build ## the laboratory's page in a Chromium, which it installs
	scripts/setup-lab.sh
	tests/lab_page/run.sh

fuzz: setup ## libFuzzer on every reader and on simulate -> adjust, SECONDS=60 each (make test: some seconds of the same)
	command -v cargo-fuzz >/dev/null || cargo install --locked cargo-fuzz
	MISCLOSURE_FUZZ_CORPUS=fuzz/corpus cargo test --release --test files fuzz::
	for target in $$(cargo fuzz list); do \
		cargo fuzz run --sanitizer none $$target -- -max_total_time=$(or $(SECONDS),60) -timeout=60 -rss_limit_mb=4096 || exit 1; \
	done

bench: setup ## both solvers side by side, with the reference for speed where there is one (time and peak memory, on four blocks); the kernels of the native one; testing the catalogue beside refitting it; testing for structure; plug-ins beside effects built in; growth with the area
	cargo bench --bench solvers
	cargo bench --bench kernels
	cargo bench --bench screening
	cargo bench --bench structure
	cargo bench --bench plugin
	cargo bench --bench areal

dist: setup ## what others install: a Debian package with both solvers, a tarball with the native one
	scripts/dist.sh

try-dist: ## install both in clean roots and run them there (as root, with debootstrap)
	scripts/try_dist.sh

wheel: ## the Python package: target/wheels/misclosure-*.whl, with the native solver
	scripts/wheel.sh

test-python: wheel ## the Python package as others install it: the wheel in a new virtual environment, tests, notebooks
	scripts/test_python.sh "$$(ls -t target/wheels/misclosure-*.whl | head -n 1)"

test-parquet: setup ## tables of a campaign as Parquet, a feature that make test leaves out
	cargo test --release --lib --no-default-features --features parquet campaign::frame

notebooks: setup ## the notebooks with their output as pages of the book: docs/notebooks
	scripts/test_python.sh built pages

clean: ## remove everything that was built
	cargo clean
