// Points of .vdb files in programs with their own OpenVDB.
#ifndef HOST_POINTS_H
#define HOST_POINTS_H

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#define CHECK(condition)                                                                       \
    do {                                                                                       \
        if (!(condition)) {                                                                    \
            std::fprintf(stderr, "%s:%d: %s does not hold\n", __FILE__, __LINE__, #condition); \
            std::exit(1);                                                                      \
        }                                                                                      \
    } while (0)

using PointLeaf = openvdb::points::PointDataTree::LeafNodeType;

// The points that frazil wrote.
inline openvdb::points::PointDataGrid::Ptr read_points(const std::string& path) {
    openvdb::io::File file(path);
    file.open();
    const auto grid = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(file.readGrid("grains"));
    file.close();
    CHECK(grid);
    return grid;
}

// A value of a point; its attribute is stored as it is.
template <typename T>
T value(const PointLeaf& leaf, const char* name, openvdb::Index point) {
    using namespace openvdb::points;
    return AttributeHandle<T, NullCodec>(leaf.constAttributeArray(name)).get(point);
}

// The place of a point in world space.
inline openvdb::Vec3d place_of(const openvdb::points::PointDataGrid& grid, const PointLeaf& leaf,
                               openvdb::Index point, const openvdb::Coord& voxel) {
    return grid.indexToWorld(voxel.asVec3d() + value<openvdb::Vec3f>(leaf, "P", point));
}

// Checks that these are all attributes, and how they are stored.
inline void check_types(const openvdb::points::AttributeSet::Descriptor& descriptor,
                        const std::vector<std::pair<const char*, const char*>>& types) {
    CHECK(descriptor.size() == types.size());
    for (const auto& [name, type] : types) {
        const size_t at = descriptor.find(name);
        CHECK(at != openvdb::points::AttributeSet::INVALID_POS);
        CHECK(descriptor.type(at) == openvdb::NamePair(type, "null"));
    }
}

#endif
