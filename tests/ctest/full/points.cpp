// Points of a program with its own OpenVDB: it writes them with codecs that lose precision, frazil converts them, and
// it reads what frazil writes.
#include "host_points.h"

#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointGroup.h>

#include <cmath>

namespace {

using namespace openvdb;
using namespace openvdb::points;

constexpr double VOXEL = 0.1;
constexpr int COUNT = 1000;

Vec3d place(int n) { return Vec3d(0.037 * n, -0.011 * n, 0.5 + 0.003 * n); }
Vec3f velocity(int n) { return Vec3f(0.25f * static_cast<float>(n % 16), -1.5f, 0.1f); }

// As Houdini does by default: places in 16-bit fixed point, velocities in 16-bit floats.
void write_as_a_host(const std::string& path) {
    std::vector<Vec3d> places;
    for (int n = 0; n < COUNT; ++n) places.push_back(place(n));
    const auto transform = math::Transform::createLinearTransform(VOXEL);
    const PointAttributeVector<Vec3d> wrapper(places);
    const auto index = tools::createPointIndexGrid<tools::PointIndexGrid>(wrapper, *transform);
    const auto grid = createPointDataGrid<FixedPointCodec<false>, PointDataGrid>(*index, wrapper, *transform);
    auto& tree = grid->tree();
    appendAttribute<Vec3f, TruncateCodec>(tree, "v");
    appendAttribute<int64_t>(tree, "id");
    appendAttribute<float, FixedPointCodec<false, UnitRange>>(tree, "age");
    appendAttribute<double>(tree, "mass");
    appendAttribute<float>(tree, "pscale", 0.02f);
    appendGroup(tree, "wet");
    for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
        const AttributeHandle<Vec3f> at(leaf->constAttributeArray("P"));
        AttributeWriteHandle<Vec3f> v(leaf->attributeArray("v"));
        AttributeWriteHandle<int64_t> id(leaf->attributeArray("id"));
        AttributeWriteHandle<float> age(leaf->attributeArray("age"));
        for (auto point = leaf->beginIndexOn(); point; ++point) {
            const Vec3d world = grid->indexToWorld(point.getCoord().asVec3d() + at.get(*point));
            const int n = static_cast<int>(std::lround(world[0] / 0.037));
            v.set(*point, velocity(n));
            id.set(*point, n);
            age.set(*point, static_cast<float>(n) / COUNT);
        }
    }
    grid->setName("points");
    io::File(path).write({grid});
}

void run(const std::string& arguments) {
    const std::string command = std::string(FRAZIL_PROGRAM) + " -q " + arguments;
    if (std::system(command.c_str()) != 0) {
        std::fprintf(stderr, "%s fails\n", command.c_str());
        std::exit(1);
    }
}

void read_what_frazil_wrote(const std::string& path) {
    const auto grid = read_points(path);
    CHECK(grid->voxelSize() == Vec3d(VOXEL));
    CHECK(pointCount(grid->tree()) == COUNT);
    const auto& descriptor = grid->tree().cbeginLeaf()->attributeSet().descriptor();
    // What frazil does not hold is left out.
    CHECK(descriptor.find("mass") == AttributeSet::INVALID_POS);
    check_types(descriptor, {{"P", "vec3s"}, {"v", "vec3s"}, {"id", "int64"}, {"age", "float"}, {"pscale", "float"}});
    std::vector<bool> seen(COUNT, false);
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
        leaf->validateOffsets();
        CHECK(leaf->constAttributeArray("pscale").isUniform());
        for (auto point = leaf->beginIndexOn(); point; ++point) {
            const auto n = static_cast<int>(value<int64_t>(*leaf, "id", *point));
            CHECK(n >= 0 && n < COUNT && !seen[static_cast<size_t>(n)]);
            seen[static_cast<size_t>(n)] = true;
            const Vec3d world = place_of(*grid, *leaf, *point, point.getCoord());
            // 16 bits over a voxel.
            CHECK((world - place(n)).length() < 2e-5 * VOXEL + 4e-6);
            CHECK((value<Vec3f>(*leaf, "v", *point) - velocity(n)).length() < 1e-3f);
            CHECK(std::abs(value<float>(*leaf, "age", *point) - static_cast<float>(n) / COUNT) < 2e-5f);
            CHECK(value<float>(*leaf, "pscale", *point) == 0.02f);
        }
    }
}

}  // namespace

int main() {
    openvdb::initialize();
    write_as_a_host("host_points.vdb");
    run("info host_points.vdb");
    run("convert host_points.vdb host_points.ply");
    run("convert host_points.ply own_points.vdb");
    read_what_frazil_wrote("own_points.vdb");
    // Without .ply between them no bit is lost.
    run("convert own_points.vdb again_points.vdb");
    read_what_frazil_wrote("again_points.vdb");
    return 0;
}
