// Two contexts in two threads on one pool: the same bytes as one after another, and no handle in two calls at once.
#include "snow.h"

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace {

std::vector<char> shot(frz_context *ctx, const frz_grid *snow, const ball &rest, int frames, bool cancels) {
    frz_base *base = nullptr;
    WORKS(frz_base_create(ctx, nullptr, snow, nullptr, 0, &base));
    auto at = std::make_unique<ball>();
    for (int frame = 0; frame < frames; ++frame) {
        ball_frame(at.get(), &rest, frame);
        const frz_body body = ball_body(at.get(), 1);
        frz_status status = FRZ_OK;
        do {
            std::thread other;
            if (cancels) other = std::thread([ctx] { frz_context_cancel(ctx); });
            status = frz_base_step(ctx, base, &body, 1, 1.0, frame, nullptr);
            if (cancels) other.join();
            frz_context_reset(ctx);
            CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
            cancels = false;
        } while (status != FRZ_OK);
        cancels = frame % 2 == 0;
    }
    const bytes all = base_bytes(ctx, base);
    std::vector<char> out(static_cast<char *>(all.data), static_cast<char *>(all.data) + all.size);
    std::free(all.data);
    frz_base_destroy(base);
    return out;
}

}  // namespace

int main() {
    auto rest = std::make_unique<ball>();
    ball_make(rest.get(), 0.1f);
    frz_pool *pool = nullptr;
    WORKS(frz_pool_create(2, &pool));
    frz_context *contexts[2] = {nullptr, nullptr};
    for (auto &ctx : contexts) WORKS(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
    frz_grid *snow = small_snow(contexts[0]);
    const std::vector<char> alone = shot(contexts[0], snow, *rest, 5, false);
    std::vector<char> both[2];
    std::thread threads[2];
    for (int i = 0; i < 2; ++i) {
        // Both read the same snow.
        threads[i] = std::thread([&, i] { both[i] = shot(contexts[i], snow, *rest, 5, i == 1); });
    }
    for (auto &thread : threads) thread.join();
    CHECK(both[0] == alone && both[1] == alone);

    // One handle in many calls at once: each works or answers FRZ_ERROR_BUSY.
    frz_base *base = nullptr;
    WORKS(frz_base_create(contexts[0], nullptr, snow, nullptr, 0, &base));
    std::atomic<int> worked{0}, busy{0};
    std::vector<std::thread> many;
    for (int i = 0; i < 4; ++i) {
        many.emplace_back([&, i] {
            auto at = std::make_unique<ball>();
            frz_context *ctx = nullptr;
            WORKS(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
            for (int frame = 0; frame < 10; ++frame) {
                ball_frame(at.get(), rest.get(), frame);
                const frz_body body = ball_body(at.get(), 1);
                size_t size = 0;
                frz_grid_info info;
                info.struct_size = sizeof info;
                const frz_status status = i % 2 ? frz_base_step(ctx, base, &body, 1, 1.0, frame, nullptr)
                                                : frz_base_save(ctx, base, nullptr, 0, &size);
                const frz_status read = frz_grid_get_info(frz_base_grid(base), &info);
                CHECK(status == FRZ_OK || status == FRZ_ERROR_BUSY);
                CHECK(read == FRZ_OK || read == FRZ_ERROR_BUSY || read == FRZ_ERROR_ARGUMENT);
                (status == FRZ_OK ? worked : busy) += 1;
            }
            frz_context_destroy(ctx);
        });
    }
    for (auto &thread : many) thread.join();
    CHECK(worked > 0);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    // In any order: contexts keep their threads.
    frz_pool_destroy(pool);
    for (auto &ctx : contexts) frz_context_destroy(ctx);
    return 0;
}
