// Shared by all sources: the grids behind the classes of the bridge, and the execution of calls.
#pragma once

#include "bridge.h"
#include "frazil/src/vdb/bridge.rs.h"

#include <openvdb/openvdb.h>
#include <openvdb/util/NullInterrupter.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <optional>
#include <stdexcept>

#ifdef FRAZIL_TREES_OF_LIBRARY
// OpenVDB's library has these instances; repeating them in each of our objects takes most of a build. build.rs checks
// that the library has all symbols that are then needed.
#define FRAZIL_IN_LIBRARY(...)                                                                        \
    extern template class openvdb::tree::Tree<openvdb::tree::Tree4<__VA_ARGS__>::Type::RootNodeType>; \
    extern template class openvdb::Grid<openvdb::tree::Tree4<__VA_ARGS__>::Type>;
FRAZIL_IN_LIBRARY(float)
FRAZIL_IN_LIBRARY(bool)
FRAZIL_IN_LIBRARY(openvdb::Int32)
FRAZIL_IN_LIBRARY(openvdb::Vec3f)
#undef FRAZIL_IN_LIBRARY
#endif

namespace frazil {

struct Impl {
    openvdb::FloatGrid::Ptr grid;
};

struct VectorImpl {
    openvdb::Vec3SGrid::Ptr grid;
};

/// Registers OpenVDB's types once.
void initialise();

/// Wraps a grid that nobody else holds.
std::unique_ptr<Grid> wrap(openvdb::FloatGrid::Ptr grid);
std::unique_ptr<VectorGrid> wrap(openvdb::Vec3SGrid::Ptr grid);

/// As `wrap`, for points; null if the grid is of another type.
std::unique_ptr<PointGrid> wrap_points(openvdb::GridBase::Ptr grid);
openvdb::GridBase::Ptr points_of(const PointGrid& grid);

/// A value as the bridge passes it; a float is the first number.
inline std::array<float, 3> triple(float value) { return {value, 0.0f, 0.0f}; }
inline std::array<float, 3> triple(const openvdb::Vec3s& value) { return {value[0], value[1], value[2]}; }

/// The text that the Rust side turns into Error::Cancelled.
struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("frazil: cancelled") {}
};

/// Stops OpenVDB's tools when the call is cancelled; the flag stays set until the call has ended.
class Interrupter : public openvdb::util::NullInterrupter {
public:
    explicit Interrupter(const Call& call) : flag_(reinterpret_cast<const volatile bool*>(call.cancel)) {}
    bool wasInterrupted(int = -1) override { return flag_ != nullptr && *flag_; }
    void check() {
        if (wasInterrupted()) throw Cancelled();
    }

private:
    const volatile bool* flag_;
};

/// Runs work that belongs to no call, on this thread alone: outside an arena TBB would start one worker per core,
/// although the host asked for none.
template <typename Work>
auto here(Work&& work) {
    tbb::task_arena arena(1);
    return arena.execute(std::forward<Work>(work));
}

/// Runs `work` with as many threads as the call may use, and reports a cancel afterwards.
template <typename Work>
auto run(const Call& call, Work&& work) {
    initialise();
    Interrupter(call).check();
    const int threads = call.threads > 0 ? call.threads : 1;
    // TBB warns on stderr when asked for more threads than cores, unless it was told to allow them.
    std::optional<tbb::global_control> allowed;
    if (threads > tbb::info::default_concurrency()) {
        allowed.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
    }
    tbb::task_arena arena(threads);
    return arena.execute(std::forward<Work>(work));
}

}  // namespace frazil
