// Values of grids at positions.
#include "impl.h"

#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace frazil {

namespace {

/// Calls `one` for each world position with an accessor, the position in index space and its index.
template <typename Source, typename One>
void at_each(const Source& source, const Call& call, rust::Slice<const double> world, One&& one) {
    run(call, [&] {
        Interrupter interrupter(call);
        tbb::parallel_for(tbb::blocked_range<size_t>(0, world.size() / 3, 1024),
                          [&](const tbb::blocked_range<size_t>& range) {
                              if (interrupter.wasInterrupted()) return;
                              auto tree = source.getConstAccessor();
                              for (size_t i = range.begin(); i != range.end(); ++i) {
                                  const openvdb::Vec3d position(world[3 * i], world[3 * i + 1], world[3 * i + 2]);
                                  one(tree, source.worldToIndex(position), i);
                              }
                          });
        interrupter.check();
    });
}

}  // namespace

void sample(const Grid& grid, const Call& call, rust::Slice<const double> world, bool linear, rust::Slice<float> out) {
    at_each(*grid.impl->grid, call, world, [&](const auto& tree, const openvdb::Vec3d& at, size_t i) {
        out[i] = linear ? openvdb::tools::BoxSampler::sample(tree, at) : openvdb::tools::PointSampler::sample(tree, at);
    });
}

void sample_vectors(const VectorGrid& grid, const Call& call, rust::Slice<const double> world, bool linear,
                    rust::Slice<float> out) {
    using namespace openvdb::tools;
    const auto& source = *grid.impl->grid;
    // Components of a staggered grid lie on the faces of voxels.
    const bool staggered = source.getGridClass() == openvdb::GRID_STAGGERED;
    at_each(source, call, world, [&](const auto& tree, const openvdb::Vec3d& at, size_t i) {
        const openvdb::Vec3s value =
            staggered ? (linear ? StaggeredBoxSampler::sample(tree, at) : StaggeredPointSampler::sample(tree, at))
                      : (linear ? BoxSampler::sample(tree, at) : PointSampler::sample(tree, at));
        for (int axis = 0; axis < 3; ++axis) out[3 * i + static_cast<size_t>(axis)] = value[axis];
    });
}

}  // namespace frazil
