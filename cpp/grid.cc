// Grids: creation, access, and bulk changes of leaves.
#include "impl.h"

#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <mutex>

namespace frazil {

using Leaf = openvdb::FloatTree::LeafNodeType;
using VectorLeaf = openvdb::Vec3STree::LeafNodeType;
static_assert(Leaf::SIZE == 512 && sizeof(Leaf::NodeMaskType) == 64, "a leaf is 8 x 8 x 8 with a 64-byte mask");
static_assert(VectorLeaf::SIZE == 512 && sizeof(VectorLeaf::NodeMaskType) == 64, "a leaf of vectors is as large");
static_assert(sizeof(openvdb::Vec3s) == 3 * sizeof(float), "vectors are packed");

// OpenVDB would destroy trees in parallel, on workers of its own.
Grid::Grid(std::unique_ptr<Impl> impl) : impl(std::move(impl)) {}
Grid::~Grid() {
    if (impl) here([&] { impl.reset(); });
}
VectorGrid::VectorGrid(std::unique_ptr<VectorImpl> impl) : impl(std::move(impl)) {}
VectorGrid::~VectorGrid() {
    if (impl) here([&] { impl.reset(); });
}

void initialise() {
    static std::once_flag once;
    std::call_once(once, [] { openvdb::initialize(); });
}

void end_workers() noexcept {
    // Fails while another part of the process uses TBB, which then keeps its threads.
    tbb::task_scheduler_handle handle{tbb::attach{}};
    tbb::finalize(handle, std::nothrow);
}

std::unique_ptr<Grid> wrap(openvdb::FloatGrid::Ptr grid) {
    auto impl = std::make_unique<Impl>();
    impl->grid = std::move(grid);
    return std::make_unique<Grid>(std::move(impl));
}

std::unique_ptr<VectorGrid> wrap(openvdb::Vec3SGrid::Ptr grid) {
    auto impl = std::make_unique<VectorImpl>();
    impl->grid = std::move(grid);
    return std::make_unique<VectorGrid>(std::move(impl));
}

std::unique_ptr<Grid> make_grid(double voxel, float background, bool level_set) {
    initialise();
    auto grid = openvdb::FloatGrid::create(background);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    if (level_set) grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return wrap(grid);
}

std::unique_ptr<VectorGrid> make_vector_grid(double voxel, std::array<float, 3> background) {
    initialise();
    auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3s(background.data()));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    return wrap(grid);
}

float background(const Grid& grid) noexcept { return grid.impl->grid->background(); }
std::array<float, 3> vector_background(const VectorGrid& grid) noexcept {
    return triple(grid.impl->grid->background());
}

bool is_uniform(const Grid& grid) noexcept {
    const auto& transform = grid.impl->grid->transform();
    return transform.isLinear() && transform.hasUniformScale();
}

std::array<double, 3> world_to_index(const Grid& grid, std::array<double, 3> p) noexcept {
    const auto i = grid.impl->grid->worldToIndex(openvdb::Vec3d(p[0], p[1], p[2]));
    return {i[0], i[1], i[2]};
}

template <typename G>
std::unique_ptr<G> copy_grid(const G& grid) {
    return here([&] { return wrap(grid.impl->grid->deepCopy()); });
}

template <typename G>
double voxel_size(const G& grid) noexcept {
    return grid.impl->grid->voxelSize()[0];
}

template <typename G>
std::array<double, 3> index_to_world(const G& grid, std::array<double, 3> p) noexcept {
    const auto w = grid.impl->grid->indexToWorld(openvdb::Vec3d(p[0], p[1], p[2]));
    return {w[0], w[1], w[2]};
}

template <typename G>
int32_t grid_class(const G& grid) noexcept {
    return static_cast<int32_t>(grid.impl->grid->getGridClass());
}

template <typename G>
void set_grid_class(G& grid, int32_t value) {
    grid.impl->grid->setGridClass(static_cast<openvdb::GridClass>(value));
}

template <typename G>
void shift(G& grid, std::array<double, 3> by) {
    grid.impl->grid->transform().postTranslate(openvdb::Vec3d(by[0], by[1], by[2]));
}

template <typename G>
rust::String name(const G& grid) noexcept {
    return rust::String::lossy(grid.impl->grid->getName());
}

template <typename G>
void set_name(G& grid, rust::Str name) {
    grid.impl->grid->setName(std::string(name));
}

template <typename G>
uint64_t active_voxels(const G& grid) noexcept {
    return here([&] { return grid.impl->grid->activeVoxelCount(); });
}

template <typename G>
size_t leaf_count(const G& grid) noexcept {
    return here([&] { return grid.impl->grid->tree().leafCount(); });
}

template <typename G>
uint64_t memory_bytes(const G& grid) noexcept {
    return here([&] { return grid.impl->grid->memUsage(); });
}

template <typename G>
uint64_t file_bound(const G& grid) noexcept {
    // Uncompressed sizes of a leaf and of the nodes above it in a file, with a margin for the codec's own data.
    const auto counts = here([&] { return grid.impl->grid->tree().nodeCount(); });
    constexpr uint64_t value = sizeof(grid.impl->grid->background());
    constexpr uint64_t leaf = 512 * value + 3 * 64 + 64;
    constexpr uint64_t lower = 4096 * value + 2 * 512 + 256, upper = 32768 * value + 2 * 4096 + 256;
    constexpr uint64_t rest = 1 << 16;
    return counts[0] * leaf + counts[1] * lower + counts[2] * upper + rest;
}

template <typename G>
bool active_bbox(const G& grid, std::array<int32_t, 3>& low, std::array<int32_t, 3>& high) {
    const auto box = here([&] { return grid.impl->grid->evalActiveVoxelBoundingBox(); });
    if (box.empty()) return false;
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = box.min()[axis];
        high[axis] = box.max()[axis];
    }
    return true;
}

namespace {

template <typename LeafType>
LeafView view(const LeafType& leaf) {
    const auto& at = leaf.origin();
    return {at[0],
            at[1],
            at[2],
            true,
            false,
            triple(0.0f),
            reinterpret_cast<size_t>(leaf.buffer().data()),
            reinterpret_cast<size_t>(&leaf.getValueMask())};
}

}  // namespace

template <typename G>
rust::Vec<LeafView> leaves(const G& grid) {
    const auto& tree = grid.impl->grid->tree();
    rust::Vec<LeafView> out;
    out.reserve(leaf_count(grid));
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) out.push_back(view(*leaf));
    return out;
}

template <typename G>
rust::Vec<LeafView> probe(const G& grid, rust::Slice<const int32_t> origins) {
    auto tree = grid.impl->grid->getConstAccessor();
    rust::Vec<LeafView> out;
    out.reserve(origins.size() / 3);
    for (size_t i = 0; i + 2 < origins.size(); i += 3) {
        const openvdb::Coord at(origins[i], origins[i + 1], origins[i + 2]);
        if (const auto* leaf = tree.probeConstLeaf(at)) {
            out.push_back(view(*leaf));
        } else {
            auto value = grid.impl->grid->background();
            const bool active = tree.probeValue(at, value);
            out.push_back({at[0], at[1], at[2], false, active, triple(value), 0, 0});
        }
    }
    return out;
}

#define FRAZIL_FUNCTIONS_OF(G)                                                               \
    template std::unique_ptr<G> copy_grid(const G&);                                         \
    template double voxel_size(const G&) noexcept;                                           \
    template std::array<double, 3> index_to_world(const G&, std::array<double, 3>) noexcept; \
    template int32_t grid_class(const G&) noexcept;                                          \
    template void set_grid_class(G&, int32_t);                                               \
    template void shift(G&, std::array<double, 3>);                                          \
    template rust::String name(const G&) noexcept;                                           \
    template void set_name(G&, rust::Str);                                                   \
    template uint64_t active_voxels(const G&) noexcept;                                      \
    template size_t leaf_count(const G&) noexcept;                                           \
    template uint64_t memory_bytes(const G&) noexcept;                                       \
    template uint64_t file_bound(const G&) noexcept;                                         \
    template bool active_bbox(const G&, std::array<int32_t, 3>&, std::array<int32_t, 3>&);   \
    template rust::Vec<LeafView> leaves(const G&);                                           \
    template rust::Vec<LeafView> probe(const G&, rust::Slice<const int32_t>)
FRAZIL_FUNCTIONS_OF(Grid);
FRAZIL_FUNCTIONS_OF(VectorGrid);
#undef FRAZIL_FUNCTIONS_OF

/// Leaves and tiles of a type of tree, outside any tree.
template <typename Tree>
struct Parts {
    std::vector<openvdb::Coord> origins;
    /// Null where the constant applies.
    std::vector<std::unique_ptr<typename Tree::LeafNodeType>> leaves;
    std::vector<typename Tree::ValueType> constants;

    void fill(const Call& call, rust::Slice<const int32_t> positions, rust::Slice<const size_t> values,
              rust::Slice<const size_t> masks) {
        using Node = typename Tree::LeafNodeType;
        const size_t count = values.size();
        leaves.resize(count);
        origins.resize(count);
        run(call, [&] {
            tbb::parallel_for(tbb::blocked_range<size_t>(0, count), [&](const tbb::blocked_range<size_t>& range) {
                for (size_t i = range.begin(); i != range.end(); ++i) {
                    const openvdb::Coord at(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
                    origins[i] = at;
                    if (values[i] == 0) continue;
                    auto leaf = std::make_unique<Node>(at, typename Tree::ValueType(0.0f), false);
                    std::memcpy(reinterpret_cast<void*>(leaf->buffer().data()),
                                reinterpret_cast<const void*>(values[i]), 512 * sizeof(typename Tree::ValueType));
                    typename Node::NodeMaskType mask;
                    std::memcpy(reinterpret_cast<void*>(&mask), reinterpret_cast<const void*>(masks[i]), sizeof mask);
                    leaf->setValueMask(mask);
                    leaves[i] = std::move(leaf);
                }
            });
        });
    }

    void put_into(Tree& tree) {
        for (size_t i = 0; i < leaves.size(); ++i) {
            if (leaves[i]) {
                tree.addLeaf(leaves[i].release());
            } else {
                tree.addTile(1, origins[i], constants[i], false);
            }
        }
    }
};

struct Blocks::Ready : Parts<openvdb::FloatTree> {};
struct VectorBlocks::Ready : Parts<openvdb::Vec3STree> {};

Blocks::Blocks(std::unique_ptr<Ready> ready) : ready(std::move(ready)) {}
Blocks::~Blocks() = default;
VectorBlocks::VectorBlocks(std::unique_ptr<Ready> ready) : ready(std::move(ready)) {}
VectorBlocks::~VectorBlocks() = default;

std::unique_ptr<Blocks> make_blocks(const Call& call, rust::Slice<const int32_t> origins,
                                    rust::Slice<const size_t> values, rust::Slice<const size_t> masks,
                                    rust::Slice<const float> constants) {
    auto ready = std::make_unique<Blocks::Ready>();
    ready->constants.assign(constants.begin(), constants.end());
    ready->fill(call, origins, values, masks);
    return std::make_unique<Blocks>(std::move(ready));
}

void put_blocks(Grid& grid, Blocks& blocks) { blocks.ready->put_into(grid.impl->grid->tree()); }

std::unique_ptr<VectorBlocks> make_vector_blocks(const Call& call, rust::Slice<const int32_t> origins,
                                                 rust::Slice<const size_t> values, rust::Slice<const size_t> masks,
                                                 rust::Slice<const float> constants) {
    auto ready = std::make_unique<VectorBlocks::Ready>();
    for (size_t i = 0; i + 2 < constants.size(); i += 3) ready->constants.emplace_back(&constants[i]);
    ready->fill(call, origins, values, masks);
    return std::make_unique<VectorBlocks>(std::move(ready));
}

void put_vector_blocks(VectorGrid& grid, VectorBlocks& blocks) { blocks.ready->put_into(grid.impl->grid->tree()); }

float value_at(const Grid& grid, int32_t x, int32_t y, int32_t z) noexcept {
    return grid.impl->grid->tree().getValue(openvdb::Coord(x, y, z));
}

void prune(Grid& grid, const Call& call, bool level_set, float tolerance) {
    run(call, [&] {
        auto& tree = grid.impl->grid->tree();
        if (level_set) {
            openvdb::tools::pruneLevelSet(tree);
        } else {
            openvdb::tools::prune(tree, tolerance);
        }
    });
}

void flood_fill(Grid& grid, const Call& call) {
    run(call, [&] { openvdb::tools::signedFloodFill(grid.impl->grid->tree()); });
}

void dilate(Grid& grid, const Call& call) {
    run(call, [&] {
        openvdb::tools::dilateActiveValues(grid.impl->grid->tree(), 1, openvdb::tools::NN_FACE,
                                           openvdb::tools::IGNORE_TILES);
    });
}

rust::Vec<uint64_t> components(const Grid& grid, const Call& call) {
    rust::Vec<uint64_t> sizes;
    run(call, [&] {
        const auto inside = openvdb::tools::sdfInteriorMask(*grid.impl->grid, 0.0f);
        std::vector<openvdb::BoolGrid::Ptr> parts;
        openvdb::tools::segmentActiveVoxels(*inside, parts);
        for (const auto& part : parts) sizes.push_back(part->activeVoxelCount());
    });
    return sizes;
}

}  // namespace frazil
