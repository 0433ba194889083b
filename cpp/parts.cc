// What a grid consists of besides its leaves, taken apart and put together again.
#include "impl.h"

#include <openvdb/io/io.h>

#include <istream>
#include <sstream>

namespace frazil {

namespace {

/// Whether a tile says what its place says without it.
bool is_empty(float value, bool active, float background) { return !active && value == background; }

}  // namespace

std::unique_ptr<std::string> grid_head(const Grid& grid) {
    const auto& base = *grid.impl->grid;
    std::ostringstream out;
    base.transform().write(out);
    base.writeMeta(out);
    return std::make_unique<std::string>(out.str());
}

rust::Vec<Tile> tiles(const Grid& grid) {
    const auto& tree = grid.impl->grid->tree();
    rust::Vec<Tile> out;
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
        const bool active = tile.isValueOn();
        const float value = *tile;
        if (is_empty(value, active, tree.background())) continue;
        const auto at = tile.getCoord();
        out.push_back({at[0], at[1], at[2], static_cast<uint32_t>(tile.getLevel()), active, value});
    }
    return out;
}

std::unique_ptr<Grid> assemble(rust::Slice<const uint8_t> head, float background, rust::Slice<const Tile> tiles) {
    initialise();
    std::istringstream in(std::string(reinterpret_cast<const char*>(head.data()), head.size()));
    in.exceptions(std::ios_base::failbit | std::ios_base::badbit);
    openvdb::io::setCurrentVersion(in);
    auto grid = openvdb::FloatGrid::create(background);
    auto transform = openvdb::math::Transform::createLinearTransform();
    transform->read(in);
    grid->setTransform(transform);
    grid->readMeta(in);
    openvdb::FloatGrid::Accessor tree = grid->getAccessor();
    for (const auto& tile : tiles)
        tree.addTile(tile.level, openvdb::Coord(tile.x, tile.y, tile.z), tile.value, tile.active);
    return wrap(grid);
}

}  // namespace frazil
