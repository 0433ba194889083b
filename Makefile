# frazil: `make demo` shows what it does, `make test` checks it.

BUILD_PACKAGES := libopenvdb-dev libboost-dev libboost-iostreams-dev g++
PACKAGES := $(BUILD_PACKAGES) cmake pkg-config clang-format python3-openvdb python3-numpy libopenvdb-tools cbindgen-web patchelf mono-mcs mono-runtime
RUST_NEEDED := 1.89
DEMO := target/demo
PREFIX := /usr/local
# Built together, the packages have the same features as in the tests, so that nothing is built twice.
BUILD := cargo build --release -p frazil -p make_scenes --lib --bin frazil --bin make_scenes

# The library without OpenVDB, built by itself: together with the whole library it would get that one's features. Both archives have the same name,
# so this one is copied to another folder; `$(BUILD)` puts the whole one back.
CORE := cargo build --release -p frazil --no-default-features --lib && mkdir -p target/core && cp target/release/libfrazil.a target/core/

.PHONY: setup setup-build setup-core demo test test-hosts test-core test-clients test-farm test-dist sanitize fuzz deny msrv site skinning-numbers pictures lint gates bench header install install-core hosts hosts-core dist wheel test-wheel blender-zip test-blender

# Everything that building and testing need, from Debian's packages; quick when it is there.
setup:
	@./tools/setup "$(RUST_NEEDED)" $(PACKAGES)

# What a build needs.
setup-build:
	@./tools/setup "$(RUST_NEEDED)" $(BUILD_PACKAGES)

# What the core library's build needs.
setup-core:
	@./tools/setup "$(RUST_NEEDED)" gcc libc6-dev

demo: setup-build
	rm -rf $(DEMO)
	$(BUILD)
	target/release/make_scenes $(DEMO)
	target/release/frazil snow $(DEMO)/box.toml -o $(DEMO)/box
	target/release/frazil preview $(DEMO)/box/base/base.0005.vdb -o $(DEMO)/box.png
	@echo "The first picture: $(DEMO)/box.png"
	target/release/frazil check $(DEMO)/hero.toml
	target/release/frazil snow $(DEMO)/hero.toml -o $(DEMO)/hero
	target/release/frazil preview $(DEMO)/hero --frames 66 -o $(DEMO)/hero.png --size 960x540 --eye=-1.75,1.2,3.1 --target 0.05,0.72,0.45 --fov 41 --sun 115,22 --fog-density 25
	target/release/frazil preview $(DEMO)/hero --frames 25-72 -o $(DEMO)/hero.gif --size 400x225 --eye=-2.3,1.5,3.2 --target 0,0.5,-0.2 --fov 46 --sun 115,22 --fog-density 25
	target/release/frazil snow $(DEMO)/walker.toml -o $(DEMO)/walker
	target/release/frazil preview $(DEMO)/walker/base/base.0048.vdb -o $(DEMO)/walker.png
	target/release/frazil preview $(DEMO)/walker/base/base.0048.vdb -o $(DEMO)/print.png --eye -0.05,1.1,1.2 --target 0.085,0.15,1.67 --fov 21 --sun 160,60
	target/release/frazil snow $(DEMO)/cube.toml -o $(DEMO)/cube
	target/release/frazil preview $(DEMO)/cube/base/base.0007.vdb -o $(DEMO)/cube.png
	target/release/frazil snow $(DEMO)/ball.toml -o $(DEMO)/ball
	target/release/frazil preview $(DEMO)/ball/base/base.0024.vdb -o $(DEMO)/ball.png
	target/release/frazil snow $(DEMO)/plough.toml -o $(DEMO)/plough
	target/release/frazil preview $(DEMO)/plough/base/base.0022.vdb $(DEMO)/plough/grains/grains.0022.usdc $(DEMO)/plough/objects/objects.0022.usdc -o $(DEMO)/plough.png --eye -0.95,0.85,0.75 --target 0.1,0.3,0.0 --sun 60,22
	target/release/frazil check $(DEMO)/liquid.toml
	target/release/frazil surface $(DEMO)/liquid.toml -o $(DEMO)/liquid
	target/release/frazil vdb from-particles $(DEMO)/liquid.%04d.bgeo --frames 1-36 --spacing 0.0125 --mesh $(DEMO)/liquid_plain.%04d.ply
	target/release/frazil preview $(DEMO)/liquid --frame 16 --color paint -o $(DEMO)/liquid.png --size 480x360 --eye=-0.15,0.42,1.28 --target -0.03,0.21,0 --fov 23 --sun=-50,30
	target/release/frazil preview $(DEMO)/liquid_plain.0016.ply -o $(DEMO)/liquid_plain.png --size 480x360 --eye=-0.15,0.42,1.28 --target -0.03,0.21,0 --fov 23 --sun=-50,30
	target/release/frazil preview $(DEMO)/liquid.0016.bgeo -o $(DEMO)/liquid_particles.png --size 480x360 --eye=-0.15,0.42,1.28 --target -0.03,0.21,0 --fov 23 --sun=-50,30
	target/release/frazil preview $(DEMO)/liquid -o $(DEMO)/liquid.gif --color paint --size 240x180 --eye=-0.1,0.45,1.3 --target -0.01,0.26,0 --fov 30 --sun=-50,30
	target/release/frazil surface $(DEMO)/drip.toml -o $(DEMO)/drip
	target/release/frazil vdb from-particles $(DEMO)/drip.0020.bgeo --spacing 0.0125 --mesh $(DEMO)/drip_plain.ply
	target/release/frazil preview $(DEMO)/drip --frame 20 --color paint -o $(DEMO)/drip.png --size 300x360 --eye=0.25,0.5,1.5 --target 0,0.28,0 --fov 27 --sun=-50,30
	target/release/frazil preview $(DEMO)/drip_plain.ply -o $(DEMO)/drip_plain.png --size 300x360 --eye=0.25,0.5,1.5 --target 0,0.28,0 --fov 27 --sun=-50,30
	target/release/frazil check examples/scenes/spill_layers.toml
	target/release/frazil shallow examples/scenes/spill_layers.toml -o $(DEMO)/spill --frames 1-361x12
	target/release/frazil preview $(DEMO)/spill --frame 301 -o $(DEMO)/spill.png --size 640x480 --eye=0.13,0.14,0.17 --target 0,0.008,0 --fov 30
	target/release/frazil preview $(DEMO)/spill -o $(DEMO)/spill.gif --size 320x240 --eye=0.13,0.14,0.17 --target 0,0.008,0 --fov 30
	target/release/frazil shallow examples/scenes/spill_falls.toml -o $(DEMO)/falls --frames 121
	target/release/frazil preview $(DEMO)/falls --frame 121 --tint milk=milk -o $(DEMO)/falls.png --size 640x480 --eye=0.13,0.11,0.17 --target 0,0.016,0 --fov 30
	target/release/frazil shallow examples/scenes/spill_incline.toml -o $(DEMO)/incline --frames 181
	target/release/frazil preview $(DEMO)/incline --frame 181 -o $(DEMO)/incline.png --size 480x360 --eye=0.1,0.16,0.13 --target 0,-0.008,0 --fov 38 --sun=-60,35
	target/release/frazil shallow examples/scenes/spill_bone.toml -o $(DEMO)/bone --frames 1-481x60
	target/release/frazil preview $(DEMO)/bone --frame 301 --tint blood=blood -o $(DEMO)/bone.png --size 480x360 --eye=0.06,0.075,0.125 --target 0.006,0.014,0 --fov 30 --sun=-45,38
	target/release/frazil preview $(DEMO)/bone --tint blood=blood -o $(DEMO)/bone.gif --size 200x150 --eye=0.06,0.075,0.125 --target 0.006,0.014,0 --fov 30 --sun=-45,38
	@echo "Pictures: $(DEMO)/hero.png $(DEMO)/hero.gif (base layer, grains and mist) $(DEMO)/walker.png $(DEMO)/print.png $(DEMO)/box.png $(DEMO)/cube.png $(DEMO)/ball.png $(DEMO)/plough.png (grains) $(DEMO)/liquid.png $(DEMO)/liquid.gif (a mesh that followed a liquid; beside it $(DEMO)/liquid_plain.png, the particles surfaced anew, and $(DEMO)/liquid_particles.png) $(DEMO)/drip.png (a mesh whose liquid pinches off and merges; beside it $(DEMO)/drip_plain.png) $(DEMO)/spill.png $(DEMO)/spill.gif $(DEMO)/incline.png (a little blood on shelves and down an incline) $(DEMO)/falls.png (milk that falls into water) $(DEMO)/bone.png $(DEMO)/bone.gif (a bone that bleeds and is rinsed); volumes: $(DEMO)/hero/base/*.vdb; the whole shot: $(DEMO)/hero/shot.usda"

lint:
	@if cargo fmt --version >/dev/null 2>&1; then cargo fmt --all --check; else echo "lint: rustfmt is not installed, skipped"; fi
	@if cargo clippy --version >/dev/null 2>&1; then cargo clippy --release --workspace --all-targets -- -D warnings; else echo "lint: clippy is not installed, skipped"; fi
	RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps --lib
	clang-format --dry-run -Werror cpp/*.cc cpp/*.h

# Tests that cannot run because data or a program is missing are listed at the end.
test: setup
	@mkdir -p target && rm -f target/skipped.txt
	cargo test --release
	./tools/bare-cli
	@$(MAKE) --no-print-directory test-hosts
	@$(MAKE) --no-print-directory test-core
	@./tools/skipped

# The C header, from the texts in src/capi.
header: setup
	./tools/header include/frazil.h

# The program, the C library, its header, and the files by which build tools find them: make install [PREFIX=/usr/local] [DESTDIR=]
install: setup-build
	$(BUILD)
	./tools/install "$(DESTDIR)$(PREFIX)"

# The C library without OpenVDB: make install-core [PREFIX=/usr/local] [DESTDIR=]; the PREFIX may be that of the whole library.
install-core: setup-core
	$(CORE)
	./tools/install-core "$(DESTDIR)$(PREFIX)"

# Programs of hosts in C and C++, built against an installed library.
hosts: setup
	$(BUILD)
	./tools/install "$(CURDIR)/target/install"
	@grep -qsxF 'CMAKE_HOME_DIRECTORY:INTERNAL=$(CURDIR)/tests/ctest/full' target/ctest/CMakeCache.txt || rm -rf target/ctest
	cmake -S tests/ctest/full -B target/ctest -DCMAKE_PREFIX_PATH="$(CURDIR)/target/install" >/dev/null
	cmake --build target/ctest --parallel $(shell nproc) >/dev/null

test-hosts: hosts
	./tools/header target/frazil.h
	cmp target/frazil.h include/frazil.h
	ctest --test-dir target/ctest --output-on-failure --output-log target/ctest/frazil.log
	FRAZIL_LIBRARY=target/install/lib/libfrazil.so.1 PYTHONPATH=python /usr/bin/python3 tests/python/test_frazil.py

# Programs of hosts of the core library, built against an installed one.
hosts-core: setup
	$(CORE)
	rm -rf target/core/install
	./tools/install-core "$(CURDIR)/target/core/install"
	@grep -qsxF 'CMAKE_HOME_DIRECTORY:INTERNAL=$(CURDIR)/tests/ctest/core' target/core/ctest/CMakeCache.txt || rm -rf target/core/ctest
	cmake -S tests/ctest/core -B target/core/ctest -DCMAKE_PREFIX_PATH="$(CURDIR)/target/core/install" >/dev/null
	cmake --build target/core/ctest --parallel $(shell nproc) >/dev/null

test-core: hosts-core
	./tools/core-symbols target/core/install
	ctest --test-dir target/core/ctest --output-on-failure --output-log target/core/ctest/frazil.log

# AddressSanitizer and UndefinedBehaviorSanitizer on the C and C++ sides, valgrind on all programs.
sanitize: hosts
	./tools/sanitize

# A tarball that runs on a bare Debian: target/dist/frazil-VERSION-x86_64.tar.gz
dist: setup
	$(BUILD)
	./tools/dist

# Python packages for pip, target/wheels/*.whl: frazil (with the program and Debian's libraries, for glibc 2.35 and newer) and frazil-core (without
# OpenVDB, for glibc 2.28 and newer). The tools are from PyPI, in target/wheel-tools.
wheel: setup
	$(CORE)
	./tools/wheel core
	$(BUILD)
	./tools/wheel full

# The packages in a bare environment.
test-wheel: wheel
	./tools/test-wheel

# The Blender add-on, target/blender/*.zip: an extension for Blender 4.2 and later, and a legacy add-on for Blender 3.4.
blender-zip: wheel
	./tools/blender-zip $${CARGO_TARGET_DIR:-target}/release/frazil

# The add-on, installed from its zips into Blender 3.4 (Debian's, also with a window on Xvfb), 4.2, 4.5 and 5.0 (bpy from PyPI).
test-blender: blender-zip demo
	@./tools/clients
	./tools/test-blender

# The tarball in a bare Debian in a folder (debootstrap; needs root and Debian's mirror).
test-dist: dist hosts
	./tools/test-dist

# Other programs: Blender and usd-core open what frazil writes, the packages for pip run in a bare environment, and the Blender add-on in four
# versions of Blender; installs them (apt-get, and PyPI into target/clients).
test-clients: setup
	@./tools/clients
	cargo test --release --test testsuite -- --nocapture scene::clients:: motion::gltf::
	@$(MAKE) --no-print-directory test-wheel test-blender

# A shot by openjd-cli and by a Slurm on loopback, compared with that of one process; installs both (apt-get, and PyPI into target/clients).
test-farm: setup
	@./tools/farm
	$(BUILD)
	/usr/bin/python3 tests/clients/farm.py target/release/frazil target/farm

# Blender's poses of CesiumMan, which tests/testsuite/motion/gltf.rs and a gate compare with.
skinning-numbers:
	@./tools/clients
	blender -b --factory-startup -noaudio --python-exit-code 7 --python tests/clients/skinning.py -- "$${FRAZIL_DATA:-../shared/data}/character/CesiumMan.glb" tests/clients/cesium_man.txt

# Each reader fuzzed for a while: make fuzz [SECONDS=60] [TARGETS="mesh particles"]; nightly Rust and cargo-fuzz.
SECONDS := 60
TARGETS := mesh particles image gltf scene states
fuzz:
	@for target in $(TARGETS); do \
	    cargo +nightly fuzz run --fuzz-dir tests/fuzz "$$target" -- -max_total_time=$(SECONDS) -rss_limit_mb=2048 -timeout=10 || exit 1; \
	done

# Licences, advisories and sources of the dependencies; needs cargo-deny.
deny:
	cargo deny --all-features check

# The oldest Rust that builds frazil, as Cargo.toml says; needs that toolchain.
msrv: setup
	cargo +$(RUST_NEEDED) check --release --all-features --lib --bins --target-dir target/msrv

# The manuals as pages: target/site/index.html; installs pandoc.
site:
	@./tools/setup "$(RUST_NEEDED)" pandoc
	@./tools/site target/site

# The pictures of characters and liquids in docs/, from models and caches in FRAZIL_DATA; those of the walker, the jelly and the drop
# come from `make demo`. Those that Blender renders need FRAZIL_BLENDER: tools/tutorial-pictures.
pictures: setup
	$(BUILD)
	@./tools/pictures "$${FRAZIL_DATA:-../shared/data}" target/pictures docs/pictures

# make gates [ONLY=snow.base.wall,...]
gates: setup hosts hosts-core
	@cargo bench --quiet --bench gates -- $(ONLY) && status=0 || status=$$?; ./tools/plots target/plots; exit $$status

# Times and errors beside the thesis', stock OpenVDB's and other methods': make bench [ONLY=snow,surface,shallow]
bench: setup
	@cargo bench --quiet --bench times -- $(ONLY)
