// Level sets from particles.
#include "impl.h"

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <vector>

namespace frazil {

namespace {

/// Maximum radius (voxels) of spheres for OpenVDB's particle tool, which fills the inside voxel by voxel: its time and
/// memory grow with the volume.
constexpr double MAX_FILLED_RADIUS = 100.0;

/// A sphere, in metres or in voxels.
struct Sphere {
    openvdb::Vec3R centre;
    openvdb::Real radius;
};

/// Spheres, with the interface that the particle tool requires.
struct Spheres {
    using PosType = openvdb::Vec3R;

    std::vector<Sphere> list;

    size_t size() const { return list.size(); }
    void getPos(size_t n, openvdb::Vec3R& at) const { at = list[n].centre; }
    void getPosRad(size_t n, openvdb::Vec3R& at, openvdb::Real& radius) const {
        getPos(n, at);
        radius = list[n].radius;
    }
};

using Tree = openvdb::FloatTree;

/// Adds the voxels of a sphere's narrow band with the index x to a tree.
void add_plane(Tree& tree, const Sphere& sphere, int x, double voxel, double half_width) {
    const openvdb::Vec3R& c = sphere.centre;
    const double outer = std::pow(sphere.radius + half_width, 2), inner = std::pow(sphere.radius - half_width, 2);
    openvdb::tree::ValueAccessor<Tree> values(tree);
    const double x2 = std::pow(x - c[0], 2);
    if (x2 >= outer) return;
    const auto add = [&](int y, double xy2, double low, double high) {
        for (int z = static_cast<int>(std::floor(low)); z <= static_cast<int>(std::ceil(high)); ++z) {
            const double xyz2 = xy2 + std::pow(z - c[2], 2);
            if (xyz2 >= outer || xyz2 <= inner) continue;
            values.setValue({x, y, z}, static_cast<float>(voxel * (std::sqrt(xyz2) - sphere.radius)));
        }
    };
    const double reach = std::sqrt(outer - x2);
    for (int y = static_cast<int>(std::floor(c[1] - reach)); y <= static_cast<int>(std::ceil(c[1] + reach)); ++y) {
        const double xy2 = x2 + std::pow(y - c[1], 2);
        if (xy2 >= outer) continue;
        const double top = std::sqrt(outer - xy2);
        if (xy2 >= inner) {
            add(y, xy2, c[2] - top, c[2] + top);
        } else {
            // Ranges that meet only write the same values twice.
            const double bottom = std::sqrt(inner - xy2);
            add(y, xy2, c[2] - top, c[2] - bottom);
            add(y, xy2, c[2] + bottom, c[2] + top);
        }
    }
}

/// A level set of one large sphere (voxels): its narrow band, and tiles inside. The same on any number of threads.
Tree::Ptr large_sphere(const Sphere& sphere, double voxel, double half_width, Interrupter& interrupter) {
    // Slabs of whole leaves, so that no two of them share one.
    constexpr int SLAB = 32;
    const double reach = sphere.radius + half_width + 1.0;
    const auto slab_of = [](double x) { return static_cast<int>(std::floor(x / SLAB)); };
    const int first = slab_of(sphere.centre[0] - reach), last = slab_of(sphere.centre[0] + reach);
    const float background = static_cast<float>(voxel * half_width);
    std::vector<Tree::Ptr> slabs(static_cast<size_t>(last - first + 1));
    tbb::parallel_for(size_t(0), slabs.size(), [&](size_t n) {
        slabs[n] = std::make_shared<Tree>(background);
        const int begin = (first + static_cast<int>(n)) * SLAB;
        for (int x = begin; x < begin + SLAB; ++x) {
            interrupter.check();
            add_plane(*slabs[n], sphere, x, voxel, half_width);
        }
    });
    const auto whole = std::make_shared<Tree>(background);
    for (const auto& slab : slabs) whole->merge(*slab);
    openvdb::tools::signedFloodFill(*whole);
    return whole;
}

}  // namespace

std::unique_ptr<Grid> from_particles(const Call& call, rust::Slice<const double> positions,
                                     rust::Slice<const float> radii, double voxel, float half_width) {
    return run(call, [&] {
        Interrupter interrupter(call);
        const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
        auto grid = openvdb::FloatGrid::create(static_cast<float>(voxel) * half_width);
        grid->setTransform(transform);
        grid->setGridClass(openvdb::GRID_LEVEL_SET);
        Spheres small;
        std::vector<Sphere> large;
        for (size_t n = 0; n < radii.size(); ++n) {
            const openvdb::Vec3R centre(positions[3 * n], positions[3 * n + 1], positions[3 * n + 2]);
            const double radius = radii[n], voxels = radius / voxel;
            if (voxels > MAX_FILLED_RADIUS) {
                large.push_back({centre / voxel, voxels});
            } else {
                small.list.push_back({centre, radius});
            }
        }
        openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid, void, openvdb::util::NullInterrupter> raster(
            *grid, &interrupter);
        // The tool's lower limit omits what the grid cannot resolve; its upper limit must omit nothing.
        raster.setRmax(2.0 * MAX_FILLED_RADIUS);
        raster.rasterizeSpheres(small);
        interrupter.check();
        raster.finalize(large.empty());
        for (const auto& sphere : large) {
            openvdb::tools::csgUnion(grid->tree(), *large_sphere(sphere, voxel, half_width, interrupter), false);
            interrupter.check();
        }
        if (!large.empty()) openvdb::tools::pruneLevelSet(grid->tree());
        return wrap(grid);
    });
}

}  // namespace frazil
