// A host that has OpenVDB itself: compiled into it, with grids and TBB at work, and a second copy of the library's file.
#include "snow.h"

#include <dlfcn.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <memory>
#include <sstream>
#include <thread>

namespace {

// Bytes of a shot that frazil makes.
bytes shot() {
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    auto rest = std::make_unique<ball>(), at = std::make_unique<ball>();
    ball_make(rest.get(), 0.1f);
    frz_base *base = nullptr;
    WORKS(frz_base_create(ctx, nullptr, snow, nullptr, 0, &base));
    for (int frame = 0; frame < 3; ++frame) {
        ball_frame(at.get(), rest.get(), frame);
        const frz_body body = ball_body(at.get(), 1);
        WORKS(frz_base_step(ctx, base, &body, 1, 1.0, frame, nullptr));
    }
    const bytes out = base_bytes(ctx, base);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return out;
}

}  // namespace

int main() {
    const bytes alone = shot();

    // The host's own grids, made before, while and after frazil works.
    openvdb::initialize();
    auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.5f, openvdb::Vec3f(0), 0.02f);
    std::atomic<bool> done{false};
    std::atomic<long> rounds{0};
    std::thread host([&] {
        while (!done || rounds == 0) {
            const auto copy = sphere->deepCopy();
            tbb::parallel_for(0, 1000, [&](int i) { copy->getConstAccessor().getValue(openvdb::Coord(i, 0, 0)); });
            ++rounds;
        }
    });
    for (int i = 0; i < 3; ++i) {
        const bytes beside = shot();
        CHECK(same_bytes(alone, beside));
        std::free(beside.data);
    }
    done = true;
    host.join();

    // The host reads what frazil wrote: bytes cross, no C++ object does.
    {
        frz_context *ctx = context_on(1);
        frz_grid *snow = small_snow(ctx);
        const frz_grid *one[1] = {snow};
        size_t size = 0;
        WORKS(frz_grid_to_bytes(ctx, one, 1, FRZ_COMPRESSION_BLOSC, 0, nullptr, 0, &size));
        std::string text(size, '\0');
        WORKS(frz_grid_to_bytes(ctx, one, 1, FRZ_COMPRESSION_BLOSC, 0, &text[0], size, &size));
        std::istringstream in(text.substr(0, size));
        const auto grids = openvdb::io::Stream(in, false).getGrids();
        frz_grid_info info;
        info.struct_size = sizeof info;
        WORKS(frz_grid_get_info(snow, &info));
        CHECK(grids->size() == 1 && (*grids)[0]->activeVoxelCount() == info.active_voxels);
        // And the other way.
        std::ostringstream out;
        openvdb::GridCPtrVec list{sphere};
        openvdb::io::Stream(out).write(list);
        const std::string bytes_of_host = out.str();
        frz_grid *mine = nullptr;
        WORKS(frz_grid_from_bytes(ctx, bytes_of_host.data(), bytes_of_host.size(), nullptr, &mine));
        WORKS(frz_grid_get_info(mine, &info));
        CHECK(info.active_voxels == sphere->activeVoxelCount());
        frz_grid_destroy(mine);
        frz_grid_destroy(snow);
        frz_context_destroy(ctx);
    }

    // Another copy of the library, as a host brings it in its own folder.
    void *copy = dlopen(SECOND_COPY, RTLD_NOW | RTLD_GLOBAL);
    if (copy == nullptr) {
        std::fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    const bytes with_copy = shot();
    CHECK(same_bytes(alone, with_copy));
    std::free(with_copy.data);
    dlclose(copy);
    const bytes after = shot();
    CHECK(same_bytes(alone, after));
    std::free(after.data);
    std::free(alone.data);
    CHECK(sphere->activeVoxelCount() > 0);
    return 0;
}
