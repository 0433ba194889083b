// Reads the grains of a .vdb file with a program's own OpenVDB, checks how their attributes are stored, and writes what
// it sees, a record a grain in the order of their identities: grain_reader FILE RECORDS
#include "host_points.h"

#include <algorithm>

namespace {

using namespace openvdb;
using namespace openvdb::points;

struct Grain {
    int64_t id;
    double place[3];
    float v[3], rest[3], pscale;
    int32_t source_frame, active;
};

std::vector<Grain> read(const std::string& path) {
    const auto grid = read_points(path);
    CHECK(grid->tree().cbeginLeaf());
    check_types(grid->tree().cbeginLeaf()->attributeSet().descriptor(),
                {{"P", "vec3s"},
                 {"v", "vec3s"},
                 {"id", "int64"},
                 {"active", "bool"},
                 {"pscale", "float"},
                 {"source_frame", "int32"},
                 {"rest", "vec3s"},
                 {"trapped", "bool"}});
    std::vector<Grain> grains;
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
        leaf->validateOffsets();
        CHECK(leaf->constAttributeArray("pscale").isUniform());
        for (auto point = leaf->beginIndexOn(); point; ++point) {
            const Vec3d place = place_of(*grid, *leaf, *point, point.getCoord());
            const Vec3f v = value<Vec3f>(*leaf, "v", *point), rest = value<Vec3f>(*leaf, "rest", *point);
            grains.push_back({value<int64_t>(*leaf, "id", *point),
                              {place[0], place[1], place[2]},
                              {v[0], v[1], v[2]},
                              {rest[0], rest[1], rest[2]},
                              value<float>(*leaf, "pscale", *point),
                              value<int32_t>(*leaf, "source_frame", *point),
                              value<bool>(*leaf, "active", *point)});
        }
    }
    CHECK(pointCount(grid->tree()) == grains.size());
    std::sort(grains.begin(), grains.end(), [](const Grain& a, const Grain& b) { return a.id < b.id; });
    return grains;
}

}  // namespace

int main(int count, char** arguments) {
    CHECK(count == 3);
    openvdb::initialize();
    const std::vector<Grain> grains = read(arguments[1]);
    std::FILE* out = std::fopen(arguments[2], "wb");
    CHECK(out);
    for (const Grain& grain : grains) {
        CHECK(std::fwrite(&grain.id, 8, 1, out) == 1 && std::fwrite(grain.place, 8, 3, out) == 3);
        CHECK(std::fwrite(grain.v, 4, 3, out) == 3 && std::fwrite(grain.rest, 4, 3, out) == 3);
        CHECK(std::fwrite(&grain.pscale, 4, 1, out) == 1 && std::fwrite(&grain.source_frame, 4, 1, out) == 1);
        CHECK(std::fwrite(&grain.active, 4, 1, out) == 1);
    }
    CHECK(std::fclose(out) == 0);
    return 0;
}
