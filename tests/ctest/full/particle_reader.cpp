// Reads the particles of a .vdb file with a program's own OpenVDB and writes what it sees, identity and place of each,
// in the order of the identities: particle_reader FILE RECORDS
#include "host_points.h"

#include <algorithm>

namespace {

using namespace openvdb;
using namespace openvdb::points;

struct Particle {
    int64_t id;
    double place[3];
};

std::vector<Particle> read(const std::string& path) {
    const auto grid = read_points(path);
    std::vector<Particle> particles;
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
        leaf->validateOffsets();
        for (auto point = leaf->beginIndexOn(); point; ++point) {
            const Vec3d place = place_of(*grid, *leaf, *point, point.getCoord());
            particles.push_back({value<int64_t>(*leaf, "id", *point), {place[0], place[1], place[2]}});
        }
    }
    CHECK(pointCount(grid->tree()) == particles.size());
    std::sort(particles.begin(), particles.end(), [](const Particle& a, const Particle& b) { return a.id < b.id; });
    return particles;
}

}  // namespace

int main(int count, char** arguments) {
    CHECK(count == 3);
    openvdb::initialize();
    const std::vector<Particle> particles = read(arguments[1]);
    std::FILE* out = std::fopen(arguments[2], "wb");
    CHECK(out);
    for (const Particle& particle : particles) {
        CHECK(std::fwrite(&particle.id, 8, 1, out) == 1 && std::fwrite(particle.place, 8, 3, out) == 3);
    }
    CHECK(std::fclose(out) == 0);
    std::printf("frazil: %zu particles\n", particles.size());
    return 0;
}
