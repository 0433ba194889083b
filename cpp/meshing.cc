// Between meshes, rays and level sets.
#include "impl.h"

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/RayIntersector.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace frazil {

namespace {

/// Triangles in index space, as meshToVolume asks for them.
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

Triangles to_mesh(const Grid& grid, const Call& call, double iso, double adaptivity) {
    return run(call, [&] {
        openvdb::tools::VolumeToMesh mesher(iso, adaptivity);
        mesher(*grid.impl->grid);
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
            out.indices.push_back(c);
            out.indices.push_back(b);
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

void measure(const Grid& grid, const Call& call, double& area, double& volume) {
    run(call, [&] {
        Interrupter interrupter(call);
        // The tool sums about the world's origin in single precision: the grid is brought there first.
        const openvdb::FloatGrid::Ptr near = grid.impl->grid->copy();
        const openvdb::Vec3d centre = near->evalActiveVoxelBoundingBox().getCenter();
        near->setTransform(near->transform().copy());
        near->transform().postTranslate(-near->indexToWorld(centre));
        openvdb::tools::LevelSetMeasure<openvdb::FloatGrid, openvdb::util::NullInterrupter> tool(*near, &interrupter);
        area = tool.area(true);
        volume = tool.volume(true);
        interrupter.check();
    });
}

void cast_rays(const Grid& grid, const Call& call, rust::Slice<const double> rays, rust::Slice<Hit> hits) {
    run(call, [&] {
        using Intersector = openvdb::tools::LevelSetRayIntersector<openvdb::FloatGrid>;
        const Intersector source(*grid.impl->grid);
        tbb::parallel_for(tbb::blocked_range<size_t>(0, hits.size(), 256),
                          [&](const tbb::blocked_range<size_t>& range) {
                              Intersector intersector(source);
                              for (size_t i = range.begin(); i != range.end(); ++i) {
                                  const openvdb::Vec3d eye(rays[6 * i], rays[6 * i + 1], rays[6 * i + 2]);
                                  const openvdb::Vec3d direction(rays[6 * i + 3], rays[6 * i + 4], rays[6 * i + 5]);
                                  const openvdb::math::Ray<double> ray(eye, direction);
                                  openvdb::Vec3d at, normal;
                                  if (intersector.intersectsWS(ray, at, normal)) {
                                      hits[i].distance = static_cast<float>((at - eye).dot(direction));
                                      for (int axis = 0; axis < 3; ++axis)
                                          hits[i].normal[axis] = static_cast<float>(normal[axis]);
                                  } else {
                                      hits[i].distance = std::numeric_limits<float>::infinity();
                                  }
                              }
                          });
    });
}

}  // namespace frazil
