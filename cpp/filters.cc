// Tools that move or mend a whole level set.
#include "impl.h"

#include <openvdb/tools/GridOperators.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetAdvect.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/LevelSetTracker.h>

namespace frazil {

namespace {

using Filter = openvdb::tools::LevelSetFilter<openvdb::FloatGrid, openvdb::FloatGrid, openvdb::util::NullInterrupter>;

/// A filter with OpenVDB's defaults (fifth-order WENO), or with one first-order pass: ten times cheaper.
void configure(Filter& filter, bool weno) {
    if (weno) return;
    filter.setSpatialScheme(openvdb::math::FIRST_BIAS);
    filter.setTemporalScheme(openvdb::math::TVD_RK1);
    filter.setNormCount(1);
}

/// Velocity along the level set's gradient at the speed that a second grid gives.
class Outward {
public:
    using VectorType = openvdb::Vec3s;
    using ValueType = float;

    Outward(const openvdb::FloatGrid& level_set, const openvdb::FloatGrid& speed)
        : gradient_(openvdb::tools::gradient(level_set)), speed_(speed) {}

    const openvdb::math::Transform& transform() const { return gradient_->transform(); }

    VectorType operator()(const openvdb::Vec3d& world, ValueType) const {
        openvdb::Vec3s n = openvdb::tools::BoxSampler::sample(gradient_->tree(), gradient_->worldToIndex(world));
        if (!n.normalize()) return VectorType(0);
        return n * openvdb::tools::BoxSampler::sample(speed_.tree(), speed_.worldToIndex(world));
    }

    VectorType operator()(const openvdb::Coord& at, ValueType) const {
        openvdb::Vec3s n = gradient_->tree().getValue(at);
        if (!n.normalize()) return VectorType(0);
        return n * openvdb::tools::BoxSampler::sample(speed_.tree(), speed_.worldToIndex(transform().indexToWorld(at)));
    }

private:
    openvdb::VectorGrid::Ptr gradient_;
    const openvdb::FloatGrid& speed_;
};

using Advection = openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, Outward, openvdb::util::NullInterrupter>;

/// Runs a tool on a copy, put in the grid's place when it is done: a cancel or an error changes nothing.
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

}  // namespace frazil

// OpenVDB chooses among its schemes when it runs, and so compiles all of them for each velocity: sixty variants, a
// minute and more. `advect_outward` takes the schemes that an advection begins with; the others are left empty.
#define FRAZIL_UNUSED(...)                                           \
    template <>                                                      \
    template <>                                                      \
    size_t frazil::Advection::__VA_ARGS__(float, float) {            \
        OPENVDB_THROW(openvdb::ValueError, "a scheme without code"); \
    }
FRAZIL_UNUSED(advect1<openvdb::math::FIRST_BIAS>)
FRAZIL_UNUSED(advect1<openvdb::math::SECOND_BIAS>)
FRAZIL_UNUSED(advect1<openvdb::math::THIRD_BIAS>)
FRAZIL_UNUSED(advect1<openvdb::math::WENO5_BIAS>)
FRAZIL_UNUSED(advect2<openvdb::math::HJWENO5_BIAS, openvdb::math::TVD_RK1>)
FRAZIL_UNUSED(advect2<openvdb::math::HJWENO5_BIAS, openvdb::math::TVD_RK3>)
#undef FRAZIL_UNUSED

namespace frazil {

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
        const Outward field(copy, *speed.impl->grid);
        Advection advection(copy, field, &interrupter);
        // Those that have code.
        advection.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
        advection.setTemporalScheme(openvdb::math::TVD_RK2);
        advection.advect(0.0, 1.0);
    });
}

}  // namespace frazil
