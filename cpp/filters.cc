// Tools that move or renormalise a whole level set.
#include "impl.h"

#include <openvdb/tools/GridOperators.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetAdvect.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/LevelSetTracker.h>

namespace frazil {

namespace {

using Filter = openvdb::tools::LevelSetFilter<openvdb::FloatGrid, openvdb::FloatGrid, openvdb::util::NullInterrupter>;

/// Configures a filter with OpenVDB's defaults (fifth-order WENO), or with one first-order pass, which is much cheaper.
void configure(Filter& filter, bool weno) {
    if (weno) return;
    filter.setSpatialScheme(openvdb::math::FIRST_BIAS);
    filter.setTemporalScheme(openvdb::math::TVD_RK1);
    filter.setNormCount(1);
}

/// The field and the interrupter for which OpenVDB's library instantiates the advection: any other field would compile
/// it here, which takes a minute.
using Field = openvdb::tools::DiscreteField<openvdb::Vec3SGrid, openvdb::tools::BoxSampler>;
using Advection = openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, Field, openvdb::util::NullInterrupter>;

/// Velocities along a level set's gradient, at the speed that a second grid gives.
openvdb::Vec3SGrid::Ptr outward(const openvdb::FloatGrid& level_set, const openvdb::FloatGrid& speed) {
    const openvdb::Vec3SGrid::Ptr velocity = openvdb::tools::gradient(level_set);
    for (auto value = velocity->beginValueOn(); value; ++value) {
        openvdb::Vec3s n = *value;
        const openvdb::Vec3d at = speed.worldToIndex(velocity->indexToWorld(value.getCoord()));
        const float along = openvdb::tools::BoxSampler::sample(speed.tree(), at);
        value.setValue(n.normalize() ? openvdb::Vec3s(n * along) : openvdb::Vec3s(0));
    }
    return velocity;
}

/// Runs a tool on a copy that replaces the grid at the end, so that a cancel or an error changes nothing.
template <typename Work>
void on_copy(Grid& grid, const Call& call, Work&& work) {
    run(call, [&] {
        Interrupter interrupter(call);
        const openvdb::FloatGrid::Ptr copy = grid.impl->grid->deepCopy();
        work(*copy, interrupter);
        interrupter.check();
        grid.impl->grid = copy;
    });
}

}  // namespace

void offset(Grid& grid, const Call& call, float metres, bool weno) {
    on_copy(grid, call, [&](openvdb::FloatGrid& copy, Interrupter& interrupter) {
        Filter filter(copy, &interrupter);
        configure(filter, weno);
        // OpenVDB counts an inward offset as positive.
        filter.offset(-metres);
    });
}

void smooth(Grid& grid, const Call& call, int32_t kind, int32_t width, int32_t times, bool weno) {
    on_copy(grid, call, [&](openvdb::FloatGrid& copy, Interrupter& interrupter) {
        Filter filter(copy, &interrupter);
        configure(filter, weno);
        for (int32_t time = 0; time < times; ++time) {
            if (kind == 0) {
                filter.mean(width);
            } else {
                filter.gaussian(width);
            }
            interrupter.check();
        }
    });
}

void renormalise(Grid& grid, const Call& call, bool weno, int32_t times) {
    on_copy(grid, call, [&](openvdb::FloatGrid& copy, Interrupter& interrupter) {
        Filter filter(copy, &interrupter);
        configure(filter, weno);
        filter.setNormCount(times);
        filter.normalize();
    });
}

void advect_outward(Grid& grid, const Call& call, const Grid& speed) {
    on_copy(grid, call, [&](openvdb::FloatGrid& copy, Interrupter& interrupter) {
        const openvdb::Vec3SGrid::Ptr velocity = outward(copy, *speed.impl->grid);
        const Field field(*velocity);
        Advection advection(copy, field, &interrupter);
        advection.advect(0.0, 1.0);
    });
}

}  // namespace frazil
