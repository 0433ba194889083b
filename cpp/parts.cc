// The parts of a grid other than its leaves: transform, metadata and tiles, taken out and assembled again.
#include "impl.h"

#include <openvdb/io/io.h>

#include <cstring>
#include <istream>
#include <sstream>

namespace frazil {

namespace {

/// A grid without leaves.
template <typename GridType>
typename GridType::Ptr without_leaves(rust::Slice<const uint8_t> head, const typename GridType::ValueType& background,
                                      rust::Slice<const Tile> tiles) {
    initialise();
    std::istringstream in(std::string(reinterpret_cast<const char*>(head.data()), head.size()));
    in.exceptions(std::ios_base::failbit | std::ios_base::badbit);
    openvdb::io::setCurrentVersion(in);
    auto grid = GridType::create(background);
    auto transform = openvdb::math::Transform::createLinearTransform();
    transform->read(in);
    grid->setTransform(transform);
    grid->readMeta(in);
    auto tree = grid->getAccessor();
    for (const auto& tile : tiles) {
        typename GridType::ValueType value;
        std::memcpy(reinterpret_cast<void*>(&value), tile.value.data(), sizeof value);
        tree.addTile(tile.level, openvdb::Coord(tile.x, tile.y, tile.z), value, tile.active);
    }
    return grid;
}

}  // namespace

template <typename G>
std::unique_ptr<std::string> grid_head(const G& grid) {
    const auto& base = *grid.impl->grid;
    std::ostringstream out;
    base.transform().write(out);
    base.writeMeta(out);
    return std::make_unique<std::string>(out.str());
}

template <typename G>
rust::Vec<Tile> tiles(const G& grid) {
    const auto& tree = grid.impl->grid->tree();
    using Values = typename std::decay_t<decltype(tree)>::ValueAllCIter;
    rust::Vec<Tile> out;
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(Values::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
        const bool active = tile.isValueOn();
        // Implied by the background.
        if (!active && *tile == tree.background()) continue;
        const auto at = tile.getCoord();
        out.push_back({at[0], at[1], at[2], static_cast<uint32_t>(tile.getLevel()), active, triple(*tile)});
    }
    return out;
}

template std::unique_ptr<std::string> grid_head(const Grid&);
template std::unique_ptr<std::string> grid_head(const VectorGrid&);
template rust::Vec<Tile> tiles(const Grid&);
template rust::Vec<Tile> tiles(const VectorGrid&);

std::unique_ptr<Grid> assemble(rust::Slice<const uint8_t> head, float background, rust::Slice<const Tile> tiles) {
    return here([&] { return wrap(without_leaves<openvdb::FloatGrid>(head, background, tiles)); });
}

std::unique_ptr<VectorGrid> assemble_vectors(rust::Slice<const uint8_t> head, std::array<float, 3> background,
                                             rust::Slice<const Tile> tiles) {
    return here(
        [&] { return wrap(without_leaves<openvdb::Vec3SGrid>(head, openvdb::Vec3s(background.data()), tiles)); });
}

}  // namespace frazil
