// Grids: making, looking into, and changing leaves in bulk.
#include "impl.h"

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetUtil.h>
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
static_assert(Leaf::SIZE == 512 && sizeof(Leaf::NodeMaskType) == 64, "a leaf is 8 x 8 x 8 with a 64-byte mask");

namespace {

/// Runs what has no call with threads of its own on this thread alone: outside of an arena TBB would start workers, as
/// many as there are cores, for a host that asked for none.
template <typename Work>
auto here(Work&& work) {
    tbb::task_arena arena(1);
    return arena.execute(std::forward<Work>(work));
}

}  // namespace

Grid::Grid(std::unique_ptr<Impl> impl) : impl(std::move(impl)) {}
Grid::~Grid() {
    // OpenVDB takes trees down in parallel.
    if (impl) here([&] { impl.reset(); });
}

void initialise() {
    static std::once_flag once;
    std::call_once(once, [] { openvdb::initialize(); });
}

void end_workers() noexcept {
    // Refused while another part of the process works with TBB: its threads are then left to it.
    tbb::task_scheduler_handle handle{tbb::attach{}};
    tbb::finalize(handle, std::nothrow);
}

std::unique_ptr<Grid> wrap(openvdb::FloatGrid::Ptr grid) {
    auto impl = std::make_unique<Impl>();
    impl->grid = std::move(grid);
    return std::make_unique<Grid>(std::move(impl));
}

std::unique_ptr<Grid> make_grid(double voxel, float background, bool level_set) {
    initialise();
    auto grid = openvdb::FloatGrid::create(background);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    if (level_set) grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return wrap(grid);
}

std::unique_ptr<Grid> copy_grid(const Grid& grid) {
    return here([&] { return wrap(grid.impl->grid->deepCopy()); });
}

double voxel_size(const Grid& grid) noexcept { return grid.impl->grid->voxelSize()[0]; }

bool is_uniform(const Grid& grid) noexcept {
    const auto& transform = grid.impl->grid->transform();
    return transform.isLinear() && transform.hasUniformScale();
}

std::array<double, 3> index_to_world(const Grid& grid, std::array<double, 3> p) noexcept {
    const auto w = grid.impl->grid->indexToWorld(openvdb::Vec3d(p[0], p[1], p[2]));
    return {w[0], w[1], w[2]};
}

std::array<double, 3> world_to_index(const Grid& grid, std::array<double, 3> p) noexcept {
    const auto i = grid.impl->grid->worldToIndex(openvdb::Vec3d(p[0], p[1], p[2]));
    return {i[0], i[1], i[2]};
}

float background(const Grid& grid) noexcept { return grid.impl->grid->background(); }
int32_t grid_class(const Grid& grid) noexcept { return static_cast<int32_t>(grid.impl->grid->getGridClass()); }
void set_grid_class(Grid& grid, int32_t value) {
    grid.impl->grid->setGridClass(static_cast<openvdb::GridClass>(value));
}
rust::String name(const Grid& grid) noexcept { return rust::String::lossy(grid.impl->grid->getName()); }
void set_name(Grid& grid, rust::Str name) { grid.impl->grid->setName(std::string(name)); }
uint64_t active_voxels(const Grid& grid) noexcept {
    return here([&] { return grid.impl->grid->activeVoxelCount(); });
}
size_t leaf_count(const Grid& grid) noexcept {
    return here([&] { return grid.impl->grid->tree().leafCount(); });
}
uint64_t memory_bytes(const Grid& grid) noexcept {
    return here([&] { return grid.impl->grid->memUsage(); });
}

bool active_bbox(const Grid& grid, std::array<int32_t, 3>& low, std::array<int32_t, 3>& high) {
    const auto box = here([&] { return grid.impl->grid->evalActiveVoxelBoundingBox(); });
    if (box.empty()) return false;
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = box.min()[axis];
        high[axis] = box.max()[axis];
    }
    return true;
}

namespace {

LeafView view(const Leaf& leaf) {
    const auto& at = leaf.origin();
    return {at[0],
            at[1],
            at[2],
            true,
            false,
            0.0f,
            reinterpret_cast<size_t>(leaf.buffer().data()),
            reinterpret_cast<size_t>(&leaf.getValueMask())};
}

}  // namespace

rust::Vec<LeafView> leaves(const Grid& grid) {
    const auto& tree = grid.impl->grid->tree();
    rust::Vec<LeafView> out;
    out.reserve(leaf_count(grid));
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) out.push_back(view(*leaf));
    return out;
}

rust::Vec<LeafView> probe(const Grid& grid, rust::Slice<const int32_t> origins) {
    openvdb::FloatGrid::ConstAccessor tree = grid.impl->grid->getConstAccessor();
    rust::Vec<LeafView> out;
    out.reserve(origins.size() / 3);
    for (size_t i = 0; i + 2 < origins.size(); i += 3) {
        const openvdb::Coord at(origins[i], origins[i + 1], origins[i + 2]);
        if (const Leaf* leaf = tree.probeConstLeaf(at)) {
            out.push_back(view(*leaf));
        } else {
            float value = 0.0f;
            const bool active = tree.probeValue(at, value);
            out.push_back({at[0], at[1], at[2], false, active, value, 0, 0});
        }
    }
    return out;
}

struct Blocks::Ready {
    std::vector<openvdb::Coord> origins;
    /// A leaf, or none where the constant counts.
    std::vector<std::unique_ptr<Leaf>> leaves;
    std::vector<float> constants;
};

Blocks::Blocks(std::unique_ptr<Ready> ready) : ready(std::move(ready)) {}
Blocks::~Blocks() = default;

std::unique_ptr<Blocks> make_blocks(const Call& call, rust::Slice<const int32_t> origins,
                                    rust::Slice<const size_t> values, rust::Slice<const size_t> masks,
                                    rust::Slice<const float> constants) {
    const size_t count = values.size();
    auto ready = std::make_unique<Blocks::Ready>();
    ready->leaves.resize(count);
    ready->origins.resize(count);
    ready->constants.assign(constants.begin(), constants.end());
    run(call, [&] {
        tbb::parallel_for(tbb::blocked_range<size_t>(0, count), [&](const tbb::blocked_range<size_t>& range) {
            for (size_t i = range.begin(); i != range.end(); ++i) {
                const openvdb::Coord at(origins[3 * i], origins[3 * i + 1], origins[3 * i + 2]);
                ready->origins[i] = at;
                if (values[i] == 0) continue;
                auto leaf = std::make_unique<Leaf>(at, 0.0f, false);
                std::memcpy(leaf->buffer().data(), reinterpret_cast<const float*>(values[i]), 512 * sizeof(float));
                Leaf::NodeMaskType mask;
                std::memcpy(reinterpret_cast<void*>(&mask), reinterpret_cast<const void*>(masks[i]), sizeof mask);
                leaf->setValueMask(mask);
                ready->leaves[i] = std::move(leaf);
            }
        });
    });
    return std::make_unique<Blocks>(std::move(ready));
}

void put_blocks(Grid& grid, Blocks& blocks) {
    auto& tree = grid.impl->grid->tree();
    auto& ready = *blocks.ready;
    for (size_t i = 0; i < ready.leaves.size(); ++i) {
        if (ready.leaves[i]) {
            tree.addLeaf(ready.leaves[i].release());
        } else {
            tree.addTile(1, ready.origins[i], ready.constants[i], false);
        }
    }
}

uint64_t file_bound(const Grid& grid) noexcept {
    // What a file holds of a leaf and of the nodes above it, none of it packed, with room for the codec's own words.
    const auto counts = here([&] { return grid.impl->grid->tree().nodeCount(); });
    constexpr uint64_t leaf = 2048 + 3 * 64 + 64, lower = 4096 * 4 + 2 * 512 + 256, upper = 32768 * 4 + 2 * 4096 + 256;
    constexpr uint64_t rest = 1 << 16;
    return counts[0] * leaf + counts[1] * lower + counts[2] * upper + rest;
}

float value_at(const Grid& grid, int32_t x, int32_t y, int32_t z) noexcept {
    return grid.impl->grid->tree().getValue(openvdb::Coord(x, y, z));
}

void sample(const Grid& grid, const Call& call, rust::Slice<const double> world, bool linear, rust::Slice<float> out) {
    const auto& source = *grid.impl->grid;
    run(call, [&] {
        Interrupter interrupter(call);
        tbb::parallel_for(
            tbb::blocked_range<size_t>(0, out.size(), 1024), [&](const tbb::blocked_range<size_t>& range) {
                if (interrupter.wasInterrupted()) return;
                auto tree = source.getConstAccessor();
                for (size_t i = range.begin(); i != range.end(); ++i) {
                    const auto at =
                        source.worldToIndex(openvdb::Vec3d(world[3 * i], world[3 * i + 1], world[3 * i + 2]));
                    out[i] = linear ? openvdb::tools::BoxSampler::sample(tree, at)
                                    : openvdb::tools::PointSampler::sample(tree, at);
                }
            });
        interrupter.check();
    });
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
