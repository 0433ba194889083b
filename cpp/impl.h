// What our sources share: the hidden grid, and how a call runs.
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

namespace frazil {

struct Impl {
    openvdb::FloatGrid::Ptr grid;
};

/// Registers OpenVDB's types once.
void initialise();

/// A grid of ours around a grid that nobody else holds.
std::unique_ptr<Grid> wrap(openvdb::FloatGrid::Ptr grid);

/// The text that the Rust side turns into Error::Cancelled.
struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("frazil: cancelled") {}
};

/// Stops OpenVDB's tools when the call is cancelled; the flag stays up until the call has ended.
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
