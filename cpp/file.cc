// Files in OpenVDB's own format.
#include "impl.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>

#include <algorithm>
#include <istream>
#include <ostream>
#include <streambuf>

namespace frazil {

namespace {

Meta to_meta(const std::string& key, const openvdb::Metadata& value) {
    Meta meta;
    meta.key = key;
    meta.kind = value.typeName();
    meta.text = rust::String::lossy(value.str());
    meta.number = 0.0;
    meta.integer = 0;
    if (const auto* v = dynamic_cast<const openvdb::FloatMetadata*>(&value)) meta.number = v->value();
    if (const auto* v = dynamic_cast<const openvdb::DoubleMetadata*>(&value)) meta.number = v->value();
    if (const auto* v = dynamic_cast<const openvdb::Int32Metadata*>(&value)) meta.integer = v->value();
    if (const auto* v = dynamic_cast<const openvdb::Int64Metadata*>(&value)) meta.integer = v->value();
    if (const auto* v = dynamic_cast<const openvdb::BoolMetadata*>(&value)) meta.integer = v->value();
    return meta;
}

openvdb::Metadata::Ptr from_meta(const Meta& meta) {
    const std::string kind(meta.kind);
    if (kind == "float") return std::make_shared<openvdb::FloatMetadata>(static_cast<float>(meta.number));
    if (kind == "double") return std::make_shared<openvdb::DoubleMetadata>(meta.number);
    if (kind == "int64") return std::make_shared<openvdb::Int64Metadata>(meta.integer);
    if (kind == "bool") return std::make_shared<openvdb::BoolMetadata>(meta.integer != 0);
    return std::make_shared<openvdb::StringMetadata>(std::string(meta.text));
}

rust::Vec<Meta> list(const openvdb::MetaMap& map) {
    rust::Vec<Meta> out;
    for (auto entry = map.beginMeta(); entry != map.endMeta(); ++entry) {
        if (entry->second) out.push_back(to_meta(entry->first, *entry->second));
    }
    return out;
}

int64_t count_of(const openvdb::GridBase& grid, const char* key) {
    const auto value = grid.getMetadata<openvdb::Int64Metadata>(key);
    return value ? value->value() : -1;
}

/// Writes to memory as File does to disk, with the offsets of the grids: readers can skip to one.
class InMemory : public openvdb::io::Archive {
public:
    using openvdb::io::Archive::write;
};

/// A stream into one string that grows by doubling: std::ostringstream would hold the bytes twice.
class Bytes : public std::streambuf {
public:
    explicit Bytes(size_t expected) { data_.reserve(expected); }

    std::unique_ptr<std::string> take() { return std::make_unique<std::string>(std::move(data_)); }

protected:
    int_type overflow(int_type letter) override {
        const char byte = traits_type::to_char_type(letter);
        xsputn(&byte, 1);
        return letter;
    }

    std::streamsize xsputn(const char* bytes, std::streamsize count) override {
        const size_t length = static_cast<size_t>(count);
        // Sizes and offsets are filled in later, over existing bytes.
        const size_t over = std::min(length, data_.size() - at_);
        data_.replace(at_, over, bytes, length);
        at_ += length;
        return count;
    }

    pos_type seekoff(off_type by, std::ios_base::seekdir from, std::ios_base::openmode) override {
        const off_type start =
            from == std::ios_base::beg ? 0 : static_cast<off_type>(from == std::ios_base::cur ? at_ : data_.size());
        return seekpos(start + by, std::ios_base::out);
    }

    pos_type seekpos(pos_type to, std::ios_base::openmode) override {
        const off_type position = to;
        if (position < 0 || static_cast<size_t>(position) > data_.size()) return pos_type(off_type(-1));
        at_ = static_cast<size_t>(position);
        return to;
    }

private:
    std::string data_;
    size_t at_ = 0;
};

/// Opens a file for reading; delayed loading would keep it mapped.
void open(openvdb::io::File& file) {
    initialise();
    file.setCopyMaxBytes(0);
    file.open(/*delayLoad=*/false);
}

/// A grid of a type, without the statistics that its file states.
template <typename GridType>
auto loaded(const openvdb::GridBase::Ptr& base) {
    auto grid = openvdb::gridPtrCast<GridType>(base);
    // Grids of a file may share their values; ours do not.
    if (grid->treePtr().use_count() > 2) grid = grid->deepCopy();
    if (grid->tree().leafCount() > 0 && grid->tree().cbeginLeaf()->buffer().isOutOfCore())
        grid->tree().readNonresidentBuffers();
    for (const char* key : {openvdb::GridBase::META_FILE_BBOX_MIN, openvdb::GridBase::META_FILE_BBOX_MAX,
                            openvdb::GridBase::META_FILE_COMPRESSION, openvdb::GridBase::META_FILE_MEM_BYTES,
                            openvdb::GridBase::META_FILE_VOXEL_COUNT, openvdb::GridBase::META_FILE_DELAYED_LOAD}) {
        grid->removeMeta(key);
    }
    return wrap(grid);
}

/// Empty for grids of other types.
Found found(const openvdb::GridBase::Ptr& base) {
    Found out;
    if (base->isType<openvdb::FloatGrid>()) out.floats = loaded<openvdb::FloatGrid>(base);
    if (base->isType<openvdb::Vec3SGrid>()) out.vectors = loaded<openvdb::Vec3SGrid>(base);
    out.points = wrap_points(base);
    return out;
}

/// Reads bytes that the caller holds.
class View : public std::streambuf {
public:
    explicit View(rust::Slice<const uint8_t> bytes) {
        // A stream's buffer is not const, but this one is only read.
        char* begin = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));
        setg(begin, begin, begin + bytes.size());
    }

protected:
    pos_type seekoff(off_type by, std::ios_base::seekdir from, std::ios_base::openmode) override {
        const off_type start = from == std::ios_base::beg   ? 0
                               : from == std::ios_base::cur ? gptr() - eback()
                                                            : egptr() - eback();
        return seekpos(start + by, std::ios_base::in);
    }

    pos_type seekpos(pos_type to, std::ios_base::openmode) override {
        const off_type position = to;
        if (position < 0 || position > egptr() - eback()) return pos_type(off_type(-1));
        setg(eback(), eback() + position, egptr());
        return to;
    }
};

/// All grids of a file's bytes.
openvdb::GridPtrVecPtr streamed(rust::Slice<const uint8_t> bytes) {
    initialise();
    View view(bytes);
    std::istream in(&view);
    // Truncated bytes must end the reading at once: OpenVDB would decompress data that was never read.
    in.exceptions(std::ios_base::failbit | std::ios_base::badbit);
    return openvdb::io::Stream(in, /*delayLoad=*/false).getGrids();
}

rust::Vec<GridHeader> describe(const openvdb::GridPtrVec& grids) {
    rust::Vec<GridHeader> out;
    for (const auto& grid : grids) {
        GridHeader header;
        header.name = rust::String::lossy(grid->getName());
        header.value_type = grid->type();
        header.class_name = openvdb::GridBase::gridClassToString(grid->getGridClass());
        header.voxel = grid->voxelSize()[0];
        header.active = count_of(*grid, openvdb::GridBase::META_FILE_VOXEL_COUNT);
        header.memory = count_of(*grid, openvdb::GridBase::META_FILE_MEM_BYTES);
        const auto low = grid->getMetadata<openvdb::Vec3IMetadata>(openvdb::GridBase::META_FILE_BBOX_MIN);
        const auto high = grid->getMetadata<openvdb::Vec3IMetadata>(openvdb::GridBase::META_FILE_BBOX_MAX);
        for (int axis = 0; axis < 3; ++axis) {
            header.low[axis] = low ? low->value()[axis] : 0;
            header.high[axis] = high ? high->value()[axis] : -1;
        }
        header.half = grid->saveFloatAsHalf();
        const auto codec = grid->getMetadata<openvdb::StringMetadata>(openvdb::GridBase::META_FILE_COMPRESSION);
        header.compression = codec ? codec->value() : std::string();
        header.meta = list(*grid);
        out.push_back(std::move(header));
    }
    return out;
}

}  // namespace

rust::Vec<Meta> metadata(const Grid& grid) { return list(*grid.impl->grid); }

void set_metadata(Grid& grid, const Meta& meta) {
    const std::string key(meta.key);
    grid.impl->grid->removeMeta(key);
    grid.impl->grid->insertMeta(key, *from_meta(meta));
}

struct Stored::Grids {
    openvdb::GridPtrVecPtr list;
};

Stored::Stored(std::unique_ptr<Grids> grids) : grids(std::move(grids)) {}
Stored::~Stored() {
    here([&] { grids.reset(); });
}

namespace {

/// The bytes of a file, of which about `expected` are reserved first.
std::unique_ptr<std::string> written(const openvdb::GridCPtrVec& list, size_t expected, int32_t compression,
                                     const openvdb::MetaMap& map) {
    constexpr uint32_t schemes[] = {openvdb::io::COMPRESS_NONE, openvdb::io::COMPRESS_ZIP, openvdb::io::COMPRESS_BLOSC};
    Bytes bytes(expected);
    std::ostream out(&bytes);
    InMemory archive;
    archive.setCompression(schemes[compression] | openvdb::io::COMPRESS_ACTIVE_MASK);
    archive.write(out, list, /*seekable=*/true, map);
    if (!out) throw std::runtime_error("the bytes of a file cannot be put together");
    return bytes.take();
}

/// From this magnitude on, numbers are rounded to infinity in 16 bits.
constexpr float OVER_HALF = 65520.0f;

bool fits_half(float value) { return std::abs(value) < OVER_HALF; }
bool fits_half(const openvdb::Vec3f& value) {
    return fits_half(value[0]) && fits_half(value[1]) && fits_half(value[2]);
}

template <typename Tree>
bool fits_half(const Tree& tree) {
    if (!fits_half(tree.background())) return false;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        const auto* values = leaf->buffer().data();
        const auto fits = [](const auto& value) { return fits_half(value); };
        if (!std::all_of(values, values + leaf->buffer().size(), fits)) return false;
    }
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
        if (!fits_half(*tile)) return false;
    }
    return true;
}

}  // namespace

bool fits_half(size_t grid, bool vectors) {
    return here([&] {
        if (vectors) return fits_half(reinterpret_cast<const VectorGrid*>(grid)->impl->grid->tree());
        return fits_half(reinterpret_cast<const Grid*>(grid)->impl->grid->tree());
    });
}

std::unique_ptr<std::string> grids_to_bytes(rust::Slice<const size_t> grids, rust::Slice<const bool> vectors,
                                            int32_t compression, bool half, const rust::Vec<Meta>& meta) {
    initialise();
    openvdb::MetaMap map;
    for (const auto& entry : meta) map.insertMeta(std::string(entry.key), *from_meta(entry));
    return here([&] {
        openvdb::GridCPtrVec list;
        // A compressed leaf of a level set takes some 370 bytes, a plain one 900: growing in steps would copy them all.
        const size_t bytes_per_leaf = compression == 2 ? 400 : 1000;
        size_t leaves = 64;
        const auto add = [&](const auto& source, size_t values) {
            // A shallow copy carries its own metadata: statistics and precision stay out of the caller's grid.
            auto copy = source->copy();
            copy->setSaveFloatAsHalf(half);
            leaves += source->tree().leafCount() * values;
            list.push_back(copy);
        };
        for (size_t i = 0; i < grids.size(); ++i) {
            if (vectors[i]) {
                add(reinterpret_cast<const VectorGrid*>(grids[i])->impl->grid, 3);
            } else {
                add(reinterpret_cast<const Grid*>(grids[i])->impl->grid, 1);
            }
        }
        return written(list, leaves * bytes_per_leaf, compression, map);
    });
}

std::unique_ptr<std::string> points_to_bytes(const PointGrid& grid, int32_t compression, const rust::Vec<Meta>& meta) {
    initialise();
    openvdb::MetaMap map;
    for (const auto& entry : meta) map.insertMeta(std::string(entry.key), *from_meta(entry));
    return here([&] {
        // A shallow copy carries its own metadata: statistics stay out of the caller's grid.
        const auto copy = points_of(grid)->copyGrid();
        // Compressed snow grains take some 45 bytes each, and a leaf has some 200.
        const size_t expected = (copy->baseTree().leafCount() + 1) * 10000;
        return written({copy}, expected, compression, map);
    });
}

rust::Vec<GridHeader> describe_file(rust::Str path) {
    return here([&] {
        openvdb::io::File file{std::string(path)};
        open(file);
        const auto headers = describe(*file.readAllGridMetadata());
        file.close();
        return headers;
    });
}

Found read_grid(rust::Str path, rust::Str name) {
    return here([&] {
        openvdb::io::File file{std::string(path)};
        open(file);
        const auto base = file.readGrid(std::string(name));
        file.close();
        return found(base);
    });
}

std::unique_ptr<Stored> read_bytes(rust::Slice<const uint8_t> bytes) {
    return here([&] {
        auto grids = std::make_unique<Stored::Grids>();
        grids->list = streamed(bytes);
        return std::make_unique<Stored>(std::move(grids));
    });
}

rust::Vec<GridHeader> describe_stored(const Stored& stored) {
    return here([&] { return describe(*stored.grids->list); });
}

Found take_stored(Stored& stored, size_t index) {
    return here([&] { return found(std::move(stored.grids->list->at(index))); });
}

}  // namespace frazil
