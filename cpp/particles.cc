// From particles to level sets.
#include "impl.h"

#include <openvdb/tools/ParticlesToLevelSet.h>

namespace frazil {

namespace {

/// Spheres as the particle tool asks for them.
struct Spheres {
    using PosType = openvdb::Vec3R;

    rust::Slice<const double> positions;
    rust::Slice<const float> radii;

    size_t size() const { return radii.size(); }
    void getPos(size_t n, openvdb::Vec3R& at) const {
        at = openvdb::Vec3R(positions[3 * n], positions[3 * n + 1], positions[3 * n + 2]);
    }
    void getPosRad(size_t n, openvdb::Vec3R& at, openvdb::Real& radius) const {
        getPos(n, at);
        radius = radii[n];
    }
};

}  // namespace

std::unique_ptr<Grid> from_particles(const Call& call, rust::Slice<const double> positions,
                                     rust::Slice<const float> radii, double voxel, float half_width) {
    return run(call, [&] {
        Interrupter interrupter(call);
        const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
        auto grid = openvdb::FloatGrid::create(static_cast<float>(voxel) * half_width);
        grid->setTransform(transform);
        grid->setGridClass(openvdb::GRID_LEVEL_SET);
        const Spheres spheres{positions, radii};
        openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid, void, openvdb::util::NullInterrupter> raster(
            *grid, &interrupter);
        // Particles of any size: what the grid cannot hold is left out, as the tool's lower limit would have it.
        raster.rasterizeSpheres(spheres);
        interrupter.check();
        raster.finalize(true);
        return wrap(grid);
    });
}

}  // namespace frazil
