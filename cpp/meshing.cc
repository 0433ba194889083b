// Conversion between meshes and level sets.
#include "impl.h"

#include <openvdb/math/Stencils.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <openvdb/tree/LeafManager.h>

#include <tbb/parallel_for.h>

#include <array>
#include <vector>

#ifdef FRAZIL_TREES_OF_LIBRARY
extern template void openvdb::tools::VolumeToMesh::operator()(const openvdb::FloatGrid&);
// The tree that `meshToVolume` uses: the library instantiates all of it except this function.
using Signs = openvdb::tree::Tree<openvdb::tree::Tree4<unsigned char>::Type::RootNodeType>;
extern template class openvdb::tree::Tree<Signs::RootNodeType>;
template void Signs::releaseAllAccessors();
#endif

namespace frazil {

namespace {

/// Triangles in index space, with the interface that meshToVolume requires.
struct IndexMesh {
    rust::Slice<const float> points;
    rust::Slice<const uint32_t> indices;
    double scale;

    size_t polygonCount() const { return indices.size() / 3; }
    size_t pointCount() const { return points.size() / 3; }
    size_t vertexCount(size_t) const { return 3; }
    void getIndexSpacePoint(size_t polygon, size_t corner, openvdb::Vec3d& at) const {
        const size_t p = indices[3 * polygon + corner];
        at = openvdb::Vec3d(points[3 * p], points[3 * p + 1], points[3 * p + 2]) * scale;
    }
};

/// The voxel in the middle of the active ones.
openvdb::Coord middle_of(const openvdb::FloatGrid& grid) {
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    return box.empty() ? openvdb::Coord() : openvdb::Coord::round(box.getCenter());
}

constexpr int32_t LEAF = 8;

/// Voxels whose part of the surface is wanted, and the blocks that hold them.
struct Wanted {
    openvdb::BoolGrid::Ptr mask;
    std::vector<openvdb::Coord> blocks;
};

Wanted wanted_of(const openvdb::FloatGrid& grid, const Part& part) {
    Wanted out{openvdb::BoolGrid::create(false), {}};
    out.mask->setTransform(grid.transform().copy());
    for (size_t i = 0; i + 2 < part.origins.size(); i += 3) {
        const openvdb::Coord origin(part.origins[i], part.origins[i + 1], part.origins[i + 2]);
        out.mask->fill(openvdb::CoordBBox(origin, origin.offsetBy(LEAF - 1)), true);
        out.blocks.push_back(origin);
    }
    openvdb::CoordBBox box(part.low[0], part.low[1], part.low[2], part.high[0], part.high[1], part.high[2]);
    // Clipped to the grid's extent, because a box may be arbitrarily large.
    openvdb::CoordBBox reach = grid.evalActiveVoxelBoundingBox();
    if (reach.empty() || !part.origins.empty()) return out;
    reach.expand(LEAF);
    box.intersect(reach);
    if (box.empty()) return out;
    out.mask->fill(box, true);
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->getNodeBoundingBox().hasOverlap(box)) out.blocks.push_back(leaf->origin());
    }
    return out;
}

/// Some blocks of a grid and their neighbours: all that a mesh of the blocks' voxels depends on.
openvdb::FloatGrid::Ptr with_neighbours(const openvdb::FloatGrid& grid, const std::vector<openvdb::Coord>& blocks) {
    const auto out = openvdb::FloatGrid::create(grid.background());
    out->setTransform(grid.transform().copy());
    out->setGridClass(grid.getGridClass());
    auto from = grid.getConstAccessor();
    auto to = out->getAccessor();
    for (const auto& block : blocks) {
        for (int n = 0; n < 27; ++n) {
            const auto at = block.offsetBy((n / 9 - 1) * LEAF, (n / 3 % 3 - 1) * LEAF, (n % 3 - 1) * LEAF);
            if (to.probeConstLeaf(at) != nullptr) continue;
            if (const auto* leaf = from.probeConstLeaf(at)) {
                to.addLeaf(new openvdb::FloatTree::LeafNodeType(*leaf));
            } else {
                to.addTile(1, at, from.getValue(at), false);
            }
        }
    }
    return out;
}

}  // namespace

std::unique_ptr<Grid> from_mesh(const Call& call, rust::Slice<const float> points, rust::Slice<const uint32_t> indices,
                                double voxel, float half_width) {
    return run(call, [&] {
        Interrupter interrupter(call);
        const IndexMesh mesh{points, indices, 1.0 / voxel};
        const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
        auto grid =
            openvdb::tools::meshToVolume<openvdb::FloatGrid>(interrupter, mesh, *transform, half_width, half_width);
        interrupter.check();
        grid->setGridClass(openvdb::GRID_LEVEL_SET);
        return wrap(grid);
    });
}

Triangles to_mesh(const Grid& grid, const Call& call, double iso, double adaptivity, const Part& part) {
    return run(call, [&] {
        openvdb::tools::VolumeToMesh mesher(iso, adaptivity);
        const openvdb::FloatGrid& whole = *grid.impl->grid;
        if (part.whole) {
            mesher(whole);
        } else {
            const Wanted wanted = wanted_of(whole, part);
            mesher.setSurfaceMask(wanted.mask);
            mesher(*with_neighbours(whole, wanted.blocks));
        }
        // A mirroring transform reverses the polygons.
        const bool mirrored = whole.transform().baseMap()->determinant() < 0.0;
        Interrupter(call).check();
        Triangles out;
        out.points.reserve(mesher.pointListSize() * 3);
        for (size_t i = 0; i < mesher.pointListSize(); ++i) {
            const auto& point = mesher.pointList()[i];
            for (int axis = 0; axis < 3; ++axis) out.points.push_back(point[axis]);
        }
        const auto add = [&](openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
            // OpenVDB's polygons are clockwise seen from outside.
            out.indices.push_back(a);
            out.indices.push_back(mirrored ? b : c);
            out.indices.push_back(mirrored ? c : b);
        };
        for (size_t n = 0; n < mesher.polygonPoolListSize(); ++n) {
            const auto& pool = mesher.polygonPoolList()[n];
            for (size_t i = 0; i < pool.numTriangles(); ++i) {
                const auto& t = pool.triangle(i);
                add(t[0], t[1], t[2]);
            }
            for (size_t i = 0; i < pool.numQuads(); ++i) {
                const auto& q = pool.quad(i);
                add(q[0], q[1], q[2]);
                add(q[0], q[2], q[3]);
            }
        }
        return out;
    });
}

// OpenVDB's LevelSetMeasure multiplies gradients by voxel indices, which amplifies errors of rounding and
// discretisation in a grid far from the origin, and it refuses grids without voxels. Here indices are relative to the
// grid's centre.
void measure(const Grid& grid, const Call& call, double& area, double& volume) {
    run(call, [&] {
        using Gradient = openvdb::math::GradStencil<openvdb::FloatGrid, false>;
        const openvdb::FloatGrid& level_set = *grid.impl->grid;
        const openvdb::Coord middle = level_set.tree().empty() ? openvdb::Coord() : middle_of(level_set);
        const double cell = level_set.voxelSize()[0];
        const openvdb::tools::DiracDelta<double> delta(1.5);
        const openvdb::tree::LeafManager<const openvdb::FloatTree> leaves(level_set.tree());
        std::vector<std::array<double, 2>> sums(leaves.leafCount());
        Interrupter interrupter(call);
        tbb::parallel_for(leaves.leafRange(), [&](const auto& range) {
            interrupter.check();
            Gradient gradient(level_set);
            for (auto leaf = range.begin(); leaf; ++leaf) {
                auto& [leaf_area, leaf_volume] = sums[leaf.pos()];
                for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
                    const double share = delta(*voxel / cell);
                    if (share <= 0.0) continue;
                    gradient.moveTo(voxel);
                    const openvdb::Vec3d slope(gradient.gradient());
                    leaf_area += share * slope.length();
                    leaf_volume += share * slope.dot((voxel.getCoord() - middle).asVec3d()) / 3.0;
                }
            }
        });
        area = volume = 0.0;
        for (const auto& [leaf_area, leaf_volume] : sums) {
            area += leaf_area * cell * cell;
            volume += leaf_volume * cell * cell * cell;
        }
    });
}

}  // namespace frazil
