// Point clouds as OpenVDB stores them: each leaf holds its points sorted by voxel, and one array for each attribute.
#include "impl.h"

#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/AttributeGroup.h>
#include <openvdb/points/AttributeSet.h>
#include <openvdb/points/PointDataGrid.h>
#include <tbb/parallel_for.h>

#include <cstring>
#include <memory>
#include <vector>

namespace frazil {

namespace {

using openvdb::points::AttributeArray;
using openvdb::points::AttributeSet;
using PointTree = openvdb::points::PointDataTree;
using PointLeaf = PointTree::LeafNodeType;

/// The types of attributes on the Rust side, in the order of its numbers.
enum PointKind : int32_t { POINT_FLOAT, POINT_INT32, POINT_INT64, POINT_BOOL, POINT_VEC3, POINT_KINDS };
constexpr const char* POINT_TYPES[POINT_KINDS] = {"float", "int32", "int64", "bool", "vec3s"};

/// Calls `work` with a value of the type of a kind.
template <typename Work>
void with_type(int32_t kind, Work&& work) {
    switch (kind) {
        case POINT_FLOAT:
            work(float());
            break;
        case POINT_INT32:
            work(int32_t());
            break;
        case POINT_INT64:
            work(int64_t());
            break;
        case POINT_BOOL:
            work(bool());
            break;
        case POINT_VEC3:
            work(openvdb::Vec3f());
            break;
        default:
            throw std::invalid_argument("an attribute of unknown type");
    }
}

/// The type in which the Rust side stores a value: a bool takes a byte.
template <typename T>
using Held = std::conditional_t<std::is_same_v<T, bool>, uint8_t, T>;

PointTree& tree_of(openvdb::GridBase& grid) { return static_cast<PointTree&>(grid.baseTree()); }

/// The leaves that hold points, in the tree's order, with the index of the first point of each.
struct PointLeaves {
    std::vector<const PointLeaf*> list;
    std::vector<size_t> starts;
    size_t count = 0;

    explicit PointLeaves(openvdb::GridBase& grid) {
        std::vector<const PointLeaf*> all;
        static_cast<const PointTree&>(tree_of(grid)).getNodes(all);
        for (const auto* leaf : all) {
            const size_t points = leaf->getLastValue();
            if (points == 0) continue;
            list.push_back(leaf);
            starts.push_back(count);
            count += points;
        }
    }

    size_t points_of(size_t leaf) const { return list[leaf]->getLastValue(); }

    /// Calls `work` with the index of each leaf.
    template <typename Work>
    void each(const Call& call, Work&& work) const {
        run(call, [&] {
            Interrupter interrupter(call);
            tbb::parallel_for(size_t(0), list.size(), [&](size_t leaf) {
                interrupter.check();
                work(leaf);
            });
        });
    }
};

/// An attribute of a leaf; in a damaged file the leaves may have different attributes.
const AttributeArray& array_of(const PointLeaf& leaf, const std::string& name) {
    const AttributeArray* array = leaf.attributeSet().getConst(name);
    if (array == nullptr) throw std::runtime_error("leaves of points that differ in their attributes");
    if (array->size() != leaf.getLastValue())
        throw std::runtime_error("arrays that differ from their number of points");
    return *array;
}

/// Copies `count` values, decoded, to the memory of the Rust side; the value of a uniform array is repeated.
template <typename T>
void copy_values(const AttributeArray& array, size_t count, Held<T>* out) {
    using Plain = openvdb::points::TypedAttributeArray<T>;
    if (!array.isUniform() && array.isType<Plain>()) {
        const T* values = static_cast<const Plain&>(array).constData();
        std::copy(values, values + count, out);
        return;
    }
    const openvdb::points::AttributeHandle<T> values(array);
    if (array.isUniform()) {
        std::fill(out, out + count, static_cast<Held<T>>(values.get(0)));
        return;
    }
    for (size_t i = 0; i < count; ++i) out[i] = static_cast<Held<T>>(values.get(static_cast<openvdb::Index>(i)));
}

/// Sets the values of an array of a leaf: those of the points `order[begin + i]`, or `begin + i` without an order.
template <typename T>
void set_values(AttributeArray& array, const PointArray& from, size_t begin, size_t count, const uint32_t* order) {
    using Plain = openvdb::points::TypedAttributeArray<T>;
    auto& typed = Plain::cast(array);
    const auto* values = reinterpret_cast<const Held<T>*>(from.address);
    if (from.uniform) {
        // Arrays start uniform; only `expand` makes room for one value per point.
        typed.setUnsafe(0, static_cast<T>(values[0]));
        return;
    }
    array.expand(/*fill=*/false);
    for (size_t i = 0; i < count; ++i) {
        const size_t point = order == nullptr ? begin + i : order[begin + i];
        typed.setUnsafe(static_cast<openvdb::Index>(i), static_cast<T>(values[point]));
    }
}

}  // namespace

struct PointGrid::Impl {
    openvdb::GridBase::Ptr grid;
};

PointGrid::PointGrid(std::unique_ptr<Impl> impl) : impl(std::move(impl)) {}
PointGrid::~PointGrid() {
    here([&] { impl.reset(); });
}

openvdb::GridBase::Ptr points_of(const PointGrid& grid) { return grid.impl->grid; }

std::unique_ptr<PointGrid> wrap_points(openvdb::GridBase::Ptr grid) {
    if (grid->type() != PointTree::treeType()) return nullptr;
    return std::make_unique<PointGrid>(std::make_unique<PointGrid::Impl>(PointGrid::Impl{std::move(grid)}));
}

std::unique_ptr<PointGrid> make_points(const Call& call, double voxel, rust::Str name, rust::Slice<const int32_t> cells,
                                       rust::Slice<const PointArray> arrays, rust::Slice<const uint32_t> order,
                                       rust::Slice<const size_t> starts) {
    return run(call, [&] {
        using openvdb::Name;
        AttributeSet::Descriptor::Ptr descriptor;
        for (const auto& array : arrays) {
            const openvdb::NamePair type(POINT_TYPES[array.kind], openvdb::points::NullCodec::name());
            descriptor = descriptor ? descriptor->duplicateAppend(Name(array.name), type)
                                    : AttributeSet::Descriptor::create(type);
        }
        const uint32_t* indices = order.empty() ? nullptr : order.data();
        const size_t count = cells.size() / 3;
        std::vector<std::unique_ptr<PointLeaf>> leaves(starts.size());
        const AttributeArray::ScopedRegistryLock lock;
        Interrupter interrupter(call);
        tbb::parallel_for(size_t(0), leaves.size(), [&](size_t n) {
            interrupter.check();
            const size_t begin = starts[n], end = n + 1 < starts.size() ? starts[n + 1] : count;
            const auto cell = [&](size_t at) {
                const int32_t* c = cells.data() + 3 * (indices == nullptr ? at : indices[at]);
                return openvdb::Coord(c[0], c[1], c[2]);
            };
            auto leaf = std::make_unique<PointLeaf>(cell(begin) & ~7);
            auto set = std::make_unique<AttributeSet>(descriptor, static_cast<openvdb::Index>(end - begin), &lock);
            for (size_t i = 0; i < arrays.size(); ++i) {
                with_type(arrays[i].kind, [&](auto value) {
                    set_values<decltype(value)>(*set->get(i), arrays[i], begin, end - begin, indices);
                });
            }
            // Each voxel's value is where its points end in the arrays.
            std::vector<PointLeaf::ValueType> ends(PointLeaf::SIZE, PointLeaf::ValueType(0));
            for (size_t at = begin; at < end; ++at) {
                const auto voxel_of = PointLeaf::coordToOffset(cell(at));
                ends[voxel_of] = static_cast<uint32_t>(at - begin + 1);
            }
            uint32_t last = 0;
            for (auto& value : ends) {
                last = std::max(last, static_cast<uint32_t>(value));
                value = last;
            }
            leaf->replaceAttributeSet(set.release(), /*allowMismatchingDescriptors=*/true);
            leaf->setOffsets(ends);
            leaves[n] = std::move(leaf);
        });
        auto grid = openvdb::GridBase::createGrid(PointTree::treeType());
        grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
        grid->setName(std::string(name));
        auto& tree = tree_of(*grid);
        for (auto& leaf : leaves) tree.addLeaf(leaf.release());
        return wrap_points(grid);
    });
}

PointsHead points_head(const PointGrid& grid, const Call& call) {
    auto& base = *grid.impl->grid;
    const PointLeaves leaves(base);
    PointsHead head;
    head.name = rust::String::lossy(base.getName());
    head.count = leaves.count;
    head.voxel = base.voxelSize()[0];
    head.is_linear = base.transform().isLinear();
    head.to_world.fill(0.0);
    if (head.is_linear) {
        const auto matrix = base.transform().baseMap()->getAffineMap()->getMat4();
        std::copy(matrix.asPointer(), matrix.asPointer() + 16, head.to_world.begin());
    }
    if (leaves.list.empty()) return head;
    leaves.each(call, [&](size_t leaf) {
        uint32_t last = 0;
        for (openvdb::Index voxel = 0; voxel < PointLeaf::SIZE; ++voxel) {
            const uint32_t end = leaves.list[leaf]->getValue(voxel);
            if (end < last) throw std::runtime_error("voxels whose points are out of order");
            last = end;
        }
    });
    const AttributeSet& first = leaves.list[0]->attributeSet();
    // The map is sorted by name; the arrays keep the order in which they were added.
    std::vector<std::string> names(first.size());
    for (const auto& [name, at] : first.descriptor().map()) names.at(at) = name;
    for (size_t at = 0; at < names.size(); ++at) {
        const std::string& name = names[at];
        const AttributeArray& array = *first.getConst(at);
        if (openvdb::points::isGroup(array)) continue;
        PointAttribute attribute;
        attribute.name = rust::String::lossy(name);
        attribute.type_name = rust::String::lossy(array.valueType());
        attribute.kind = -1;
        for (int32_t kind = 0; kind < POINT_KINDS; ++kind) {
            if (array.valueType() == POINT_TYPES[kind] && array.stride() == 1) attribute.kind = kind;
        }
        attribute.uniform = attribute.kind >= 0;
        if (attribute.uniform) {
            with_type(attribute.kind, [&](auto value) {
                using T = decltype(value);
                Held<T> expected;
                copy_values<T>(array, 1, &expected);
                for (const auto* leaf : leaves.list) {
                    const AttributeArray& other = array_of(*leaf, name);
                    Held<T> own;
                    if (attribute.uniform && other.isUniform()) copy_values<T>(other, 1, &own);
                    attribute.uniform =
                        attribute.uniform && other.isUniform() && std::memcmp(&expected, &own, sizeof own) == 0;
                }
            });
        }
        head.attributes.push_back(std::move(attribute));
    }
    return head;
}

void point_cells(const PointGrid& grid, const Call& call, rust::Slice<int32_t> out) {
    const PointLeaves leaves(*grid.impl->grid);
    if (out.size() != 3 * leaves.count) throw std::invalid_argument("cells for another number of points");
    leaves.each(call, [&](size_t n) {
        const PointLeaf& leaf = *leaves.list[n];
        int32_t* at = out.data() + 3 * leaves.starts[n];
        uint32_t begin = 0;
        for (openvdb::Index voxel = 0; voxel < PointLeaf::SIZE; ++voxel) {
            const uint32_t end = leaf.getValue(voxel);
            const openvdb::Coord cell = leaf.offsetToGlobalCoord(voxel);
            for (; begin < end; ++begin, at += 3) std::copy(cell.asPointer(), cell.asPointer() + 3, at);
        }
    });
}

void point_values(const PointGrid& grid, const Call& call, rust::Str attribute, int32_t kind, size_t address,
                  size_t count) {
    const std::string name(attribute);
    const PointLeaves leaves(*grid.impl->grid);
    if (count != leaves.count && count != 1) throw std::invalid_argument("values for another number of points");
    with_type(kind, [&](auto value) {
        using T = decltype(value);
        auto* out = reinterpret_cast<Held<T>*>(address);
        if (count == 1) {
            copy_values<T>(array_of(*leaves.list.at(0), name), 1, out);
            return;
        }
        leaves.each(call, [&](size_t n) {
            copy_values<T>(array_of(*leaves.list[n], name), leaves.points_of(n), out + leaves.starts[n]);
        });
    });
}

}  // namespace frazil
