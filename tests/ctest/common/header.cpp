// The header in C++17: enums have their size, handles go into smart pointers. With FRZ_CORE and without: both declare what the core
// library has, only the whole one grids.
#include <frazil.h>

#include <memory>
#include <type_traits>

#if defined(FRZ_CORE) == defined(FRZ_HAS_OPENVDB)
#error "the header is that of the core library or that of the whole one"
#endif
#if defined(FRZ_CORE) == defined(FRZ_HALF)
#error "only the whole library has flags of grids"
#endif

static_assert(sizeof(frz_status) == 4 && sizeof(frz_view) == 3 * sizeof(void *), "the layout of C");
static_assert(std::is_standard_layout<frz_mesh_desc>::value, "the layout of C");
#ifndef FRZ_CORE
static_assert(std::is_standard_layout<frz_body>::value, "the layout of C");
#endif

template <auto destroy> struct Destroyer {
    template <typename Handle> void operator()(Handle *handle) const { destroy(handle); }
};

using Pool = std::unique_ptr<frz_pool, Destroyer<frz_pool_destroy>>;
using Context = std::unique_ptr<frz_context, Destroyer<frz_context_destroy>>;

int main() {
    frz_pool *pool = nullptr;
    if (frz_pool_create(1, &pool) != FRZ_OK) return 1;
    const Pool owned_pool(pool);
    frz_context *ctx = nullptr;
    if (frz_context_create(FRZ_ABI_VERSION, pool, &ctx) != FRZ_OK) return 2;
    const Context owned(ctx);
    return 0;
}
