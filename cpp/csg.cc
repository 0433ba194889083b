// Constructive solid geometry of level sets.
#include "impl.h"

#include <openvdb/tools/Composite.h>

namespace frazil {

enum Operation : int32_t { UNION = 0, DIFFERENCE = 1, INTERSECTION = 2 };

void csg(Grid& a, Grid& b, const Call& call, int32_t operation) {
    run(call, [&] {
        auto& first = *a.impl->grid;
        auto& second = *b.impl->grid;
        switch (operation) {
            case UNION:
                openvdb::tools::csgUnion(first, second);
                break;
            case DIFFERENCE:
                openvdb::tools::csgDifference(first, second);
                break;
            default:
                openvdb::tools::csgIntersection(first, second);
                break;
        }
    });
}

std::unique_ptr<Grid> csg_copy(const Grid& a, const Grid& b, const Call& call, int32_t operation) {
    return run(call, [&] {
        const auto& first = *a.impl->grid;
        const auto& second = *b.impl->grid;
        switch (operation) {
            case UNION:
                return wrap(openvdb::tools::csgUnionCopy(first, second));
            case DIFFERENCE:
                return wrap(openvdb::tools::csgDifferenceCopy(first, second));
            default:
                return wrap(openvdb::tools::csgIntersectionCopy(first, second));
        }
    });
}

}  // namespace frazil
