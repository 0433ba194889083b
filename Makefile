# frazil: `make demo` shows what it does, `make test` checks it.

PACKAGES := libopenvdb-dev libboost-dev libboost-iostreams-dev g++ cmake pkg-config clang-format python3-openvdb libopenvdb-tools
RUST_NEEDED := 1.89
DEMO := target/demo

.PHONY: setup demo test test-clients skinning-numbers pictures lint gates bench

# Everything a build needs, from Debian's packages; quick when it is there.
setup:
	@./tools/setup "$(RUST_NEEDED)" $(PACKAGES)

demo: setup
	rm -rf $(DEMO)
	cargo build --release --bin frazil --example make_scenes
	target/release/examples/make_scenes $(DEMO)
	target/release/frazil check $(DEMO)/hero.toml
	target/release/frazil snow $(DEMO)/hero.toml -o $(DEMO)/hero
	target/release/frazil preview $(DEMO)/hero/base/base.0070.vdb $(DEMO)/hero/objects/objects.0070.ply -o $(DEMO)/hero.png --eye 1.9,1.9,-3.0 --target 0,0.7,0.2 --fov 39 --sun 250,35
	target/release/frazil snow $(DEMO)/walker.toml -o $(DEMO)/walker
	target/release/frazil preview $(DEMO)/walker/base/base.0048.vdb -o $(DEMO)/walker.png
	target/release/frazil preview $(DEMO)/walker/base/base.0048.vdb -o $(DEMO)/print.png --eye -0.05,1.1,1.2 --target 0.085,0.15,1.67 --fov 21 --sun 160,60
	target/release/frazil snow $(DEMO)/box.toml -o $(DEMO)/box
	target/release/frazil preview $(DEMO)/box/base/base.0005.vdb -o $(DEMO)/box.png
	target/release/frazil snow $(DEMO)/cube.toml -o $(DEMO)/cube
	target/release/frazil preview $(DEMO)/cube/base/base.0007.vdb -o $(DEMO)/cube.png
	target/release/frazil snow $(DEMO)/ball.toml -o $(DEMO)/ball
	target/release/frazil preview $(DEMO)/ball/base/base.0024.vdb -o $(DEMO)/ball.png
	@echo "Pictures: $(DEMO)/hero.png $(DEMO)/walker.png $(DEMO)/print.png $(DEMO)/box.png $(DEMO)/cube.png $(DEMO)/ball.png; volumes: $(DEMO)/hero/base/*.vdb; the whole shot: $(DEMO)/hero/shot.usda"

lint:
	@if cargo fmt --version >/dev/null 2>&1; then cargo fmt --check; else echo "lint: rustfmt is not installed, skipped"; fi
	@if cargo clippy --version >/dev/null 2>&1; then cargo clippy --release --all-targets -- -D warnings; else echo "lint: clippy is not installed, skipped"; fi
	clang-format --dry-run -Werror cpp/*.cc cpp/*.h

test: setup lint
	cargo test --release
	RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps --lib
	cargo check --release --no-default-features --lib

# Blender and usd-core open what frazil writes; installs them (apt-get, and PyPI into target/clients).
test-clients: setup
	@./tools/clients
	cargo test --release --test clients --test motion_gltf -- --nocapture

# Blender's poses of CesiumMan, which tests/motion_gltf.rs and a gate compare with.
skinning-numbers:
	@./tools/clients
	blender -b --factory-startup -noaudio --python-exit-code 7 --python tests/clients/skinning.py -- "$${FRAZIL_DATA:-../shared/data}/character/CesiumMan.glb" tests/clients/cesium_man.txt

# The pictures of characters in docs/, from models in FRAZIL_DATA; those of the walker come from `make demo`.
pictures: setup
	cargo build --release --bin frazil
	@./tools/pictures "$${FRAZIL_DATA:-../shared/data}" target/pictures docs/pictures

# make gates [ONLY=snow.base.wall,...]
gates: setup
	@cargo bench --quiet --bench gates -- $(ONLY)

# Times beside the thesis' and stock OpenVDB's.
bench: setup
	@cargo bench --quiet --bench times
