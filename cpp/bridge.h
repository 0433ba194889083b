// The C++ classes and functions that Rust sees; no OpenVDB header here.
#pragma once

#include "rust/cxx.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace frazil {

struct Impl;
struct VectorImpl;

/// A float grid whose tree nobody else shares.
class Grid {
public:
    explicit Grid(std::unique_ptr<Impl> impl);
    ~Grid();
    Grid(const Grid&) = delete;
    Grid& operator=(const Grid&) = delete;
    std::unique_ptr<Impl> impl;
};

/// A grid of vectors of three floats whose tree nobody else shares.
class VectorGrid {
public:
    explicit VectorGrid(std::unique_ptr<VectorImpl> impl);
    ~VectorGrid();
    VectorGrid(const VectorGrid&) = delete;
    VectorGrid& operator=(const VectorGrid&) = delete;
    std::unique_ptr<VectorImpl> impl;
};

/// Leaves and tiles that are ready to be put into a grid.
class Blocks {
public:
    struct Ready;
    explicit Blocks(std::unique_ptr<Ready> ready);
    ~Blocks();
    Blocks(const Blocks&) = delete;
    Blocks& operator=(const Blocks&) = delete;
    std::unique_ptr<Ready> ready;
};

/// The same for a grid of vectors.
class VectorBlocks {
public:
    struct Ready;
    explicit VectorBlocks(std::unique_ptr<Ready> ready);
    ~VectorBlocks();
    VectorBlocks(const VectorBlocks&) = delete;
    VectorBlocks& operator=(const VectorBlocks&) = delete;
    std::unique_ptr<Ready> ready;
};

/// A grid of points, each with its position and attributes.
class PointGrid {
public:
    struct Impl;
    explicit PointGrid(std::unique_ptr<Impl> impl);
    ~PointGrid();
    PointGrid(const PointGrid&) = delete;
    PointGrid& operator=(const PointGrid&) = delete;
    std::unique_ptr<Impl> impl;
};

/// The grids that the bytes of a file hold, of any type.
class Stored {
public:
    struct Grids;
    explicit Stored(std::unique_ptr<Grids> grids);
    ~Stored();
    Stored(const Stored&) = delete;
    Stored& operator=(const Stored&) = delete;
    std::unique_ptr<Grids> grids;
};

struct LeafView;
struct Found;
struct Meta;
struct GridHeader;
struct Call;
struct Tile;
struct Triangles;
struct Part;
struct PointArray;
struct PointsHead;

std::unique_ptr<Grid> make_grid(double voxel, float background, bool level_set);
std::unique_ptr<VectorGrid> make_vector_grid(double voxel, std::array<float, 3> background);
float background(const Grid& grid) noexcept;
std::array<float, 3> vector_background(const VectorGrid& grid) noexcept;

// For both kinds of grid.
template <typename G>
std::unique_ptr<G> copy_grid(const G& grid);
template <typename G>
double voxel_size(const G& grid) noexcept;
template <typename G>
std::array<double, 3> index_to_world(const G& grid, std::array<double, 3> index) noexcept;
template <typename G>
int32_t grid_class(const G& grid) noexcept;
template <typename G>
void set_grid_class(G& grid, int32_t grid_class);
template <typename G>
void shift(G& grid, std::array<double, 3> by);
template <typename G>
rust::String name(const G& grid) noexcept;
template <typename G>
void set_name(G& grid, rust::Str name);
template <typename G>
uint64_t active_voxels(const G& grid) noexcept;
template <typename G>
size_t leaf_count(const G& grid) noexcept;
template <typename G>
uint64_t memory_bytes(const G& grid) noexcept;
template <typename G>
uint64_t file_bound(const G& grid) noexcept;
template <typename G>
bool active_bbox(const G& grid, std::array<int32_t, 3>& low, std::array<int32_t, 3>& high);
template <typename G>
rust::Vec<LeafView> leaves(const G& grid);
template <typename G>
rust::Vec<LeafView> probe(const G& grid, rust::Slice<const int32_t> origins);
template <typename G>
std::unique_ptr<std::string> grid_head(const G& grid);
template <typename G>
rust::Vec<Tile> tiles(const G& grid);

bool is_uniform(const Grid& grid) noexcept;
std::array<double, 3> world_to_index(const Grid& grid, std::array<double, 3> world) noexcept;
rust::Vec<Meta> metadata(const Grid& grid);
void set_metadata(Grid& grid, const Meta& meta);
std::unique_ptr<Blocks> make_blocks(const Call& call, rust::Slice<const int32_t> origins,
                                    rust::Slice<const size_t> values, rust::Slice<const size_t> masks,
                                    rust::Slice<const float> constants);
void put_blocks(Grid& grid, Blocks& blocks);
std::unique_ptr<VectorBlocks> make_vector_blocks(const Call& call, rust::Slice<const int32_t> origins,
                                                 rust::Slice<const size_t> values, rust::Slice<const size_t> masks,
                                                 rust::Slice<const float> constants);
void put_vector_blocks(VectorGrid& grid, VectorBlocks& blocks);
float value_at(const Grid& grid, int32_t x, int32_t y, int32_t z) noexcept;
void sample(const Grid& grid, const Call& call, rust::Slice<const double> world, bool linear, rust::Slice<float> out);
void sample_vectors(const VectorGrid& grid, const Call& call, rust::Slice<const double> world, bool linear,
                    rust::Slice<float> out);
void prune(Grid& grid, const Call& call, bool level_set, float tolerance);
void flood_fill(Grid& grid, const Call& call);
void dilate(Grid& grid, const Call& call);
rust::Vec<uint64_t> components(const Grid& grid, const Call& call);

bool fits_half(size_t grid, bool vectors);
std::unique_ptr<std::string> grids_to_bytes(rust::Slice<const size_t> grids, rust::Slice<const bool> vectors,
                                            int32_t compression, bool half, const rust::Vec<Meta>& meta);
std::unique_ptr<std::string> points_to_bytes(const PointGrid& grid, int32_t compression, const rust::Vec<Meta>& meta);
rust::Vec<GridHeader> describe_file(rust::Str path);
Found read_grid(rust::Str path, rust::Str name);
std::unique_ptr<Stored> read_bytes(rust::Slice<const uint8_t> bytes);
rust::Vec<GridHeader> describe_stored(const Stored& stored);
Found take_stored(Stored& stored, size_t index);
std::unique_ptr<Grid> assemble(rust::Slice<const uint8_t> head, float background, rust::Slice<const Tile> tiles);
std::unique_ptr<VectorGrid> assemble_vectors(rust::Slice<const uint8_t> head, std::array<float, 3> background,
                                             rust::Slice<const Tile> tiles);
void end_workers() noexcept;

std::unique_ptr<PointGrid> make_points(const Call& call, double voxel, rust::Str name, rust::Slice<const int32_t> cells,
                                       rust::Slice<const PointArray> arrays, rust::Slice<const uint32_t> order,
                                       rust::Slice<const size_t> starts);
PointsHead points_head(const PointGrid& grid, const Call& call);
void point_cells(const PointGrid& grid, const Call& call, rust::Slice<int32_t> out);
void point_values(const PointGrid& grid, const Call& call, rust::Str attribute, int32_t kind, size_t address,
                  size_t count);

void csg(Grid& a, Grid& b, const Call& call, int32_t operation);
std::unique_ptr<Grid> csg_copy(const Grid& a, const Grid& b, const Call& call, int32_t operation);

void offset(Grid& grid, const Call& call, float metres, bool weno);
void smooth(Grid& grid, const Call& call, int32_t kind, int32_t width, int32_t times, bool weno);
void renormalise(Grid& grid, const Call& call, bool weno, int32_t times);
void advect_outward(Grid& grid, const Call& call, const Grid& speed);

std::unique_ptr<Grid> from_mesh(const Call& call, rust::Slice<const float> points, rust::Slice<const uint32_t> indices,
                                double voxel, float half_width);
std::unique_ptr<Grid> from_particles(const Call& call, rust::Slice<const double> positions,
                                     rust::Slice<const float> radii, double voxel, float half_width);
Triangles to_mesh(const Grid& grid, const Call& call, double iso, double adaptivity, const Part& part);
void measure(const Grid& grid, const Call& call, double& area, double& volume);

}  // namespace frazil

namespace rust::behavior {

/// Turns anything thrown into an error text: no exception crosses the bridge.
template <typename Try, typename Fail>
void trycatch(Try&& attempt, Fail&& fail) noexcept {
    try {
        attempt();
    } catch (const std::exception& error) {
        fail(error.what());
    } catch (...) {
        fail("an exception of unknown type");
    }
}

}  // namespace rust::behavior
