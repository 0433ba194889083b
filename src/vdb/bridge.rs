//! The only door to C++: declarations, no logic.

#[cxx::bridge(namespace = "frazil")]
pub(super) mod ffi {
    /// Where a leaf lies in memory.
    struct LeafView {
        x: i32,
        y: i32,
        z: i32,
        /// 1 when `values` and `mask` are set; else the tile below counts.
        is_leaf: bool,
        tile_active: bool,
        tile: f32,
        values: usize,
        mask: usize,
    }

    /// A metadata entry; `kind` says which of the values counts.
    struct Meta {
        key: String,
        /// "string", "float", "double", "int", "bool", or another type's name with its text.
        kind: String,
        text: String,
        number: f64,
        integer: i64,
    }

    /// What a file says of one of its grids.
    struct GridHeader {
        name: String,
        value_type: String,
        class_name: String,
        voxel: f64,
        active: i64,
        low: [i32; 3],
        high: [i32; 3],
        memory: i64,
        half: bool,
        compression: String,
        meta: Vec<Meta>,
    }

    /// A value above the leaves.
    struct Tile {
        x: i32,
        y: i32,
        z: i32,
        /// 1 for a place of 8 voxels along an edge, 2 for 128, 3 for 4096.
        level: u32,
        active: bool,
        value: f32,
    }

    /// Threads and cancel flag of a call.
    struct Call {
        threads: i32,
        /// Address of the call's cancel flag (one byte), or 0.
        cancel: usize,
    }

    struct Triangles {
        points: Vec<f32>,
        indices: Vec<u32>,
    }

    /// What of a grid becomes a mesh: all, the blocks at some origins, or without any the voxels of a box.
    struct Part {
        whole: bool,
        /// Three numbers each.
        origins: Vec<i32>,
        /// Least and greatest voxel, both included.
        low: [i32; 3],
        high: [i32; 3],
    }

    struct Hit {
        distance: f32,
        normal: [f32; 3],
    }

    unsafe extern "C++" {
        include!("bridge.h");

        type Grid;
        fn make_grid(voxel: f64, background: f32, level_set: bool) -> Result<UniquePtr<Grid>>;
        fn copy_grid(grid: &Grid) -> Result<UniquePtr<Grid>>;
        fn voxel_size(grid: &Grid) -> f64;
        fn is_uniform(grid: &Grid) -> bool;
        fn index_to_world(grid: &Grid, index: [f64; 3]) -> [f64; 3];
        fn world_to_index(grid: &Grid, world: [f64; 3]) -> [f64; 3];
        fn background(grid: &Grid) -> f32;
        fn grid_class(grid: &Grid) -> i32;
        fn set_grid_class(grid: Pin<&mut Grid>, number: i32) -> Result<()>;
        fn name(grid: &Grid) -> String;
        fn set_name(grid: Pin<&mut Grid>, name: &str) -> Result<()>;
        fn metadata(grid: &Grid) -> Result<Vec<Meta>>;
        fn set_metadata(grid: Pin<&mut Grid>, meta: &Meta) -> Result<()>;
        fn active_voxels(grid: &Grid) -> u64;
        fn leaf_count(grid: &Grid) -> usize;
        fn memory_bytes(grid: &Grid) -> u64;
        fn active_bbox(grid: &Grid, low: &mut [i32; 3], high: &mut [i32; 3]) -> Result<bool>;
        fn leaves(grid: &Grid) -> Result<Vec<LeafView>>;
        fn probe(grid: &Grid, origins: &[i32]) -> Result<Vec<LeafView>>;
        type Blocks;
        /// `values[i]` is the address of 512 floats, or 0 for a constant block of value `constants[i]`.
        fn make_blocks(
            call: &Call,
            origins: &[i32],
            values: &[usize],
            masks: &[usize],
            constants: &[f32],
        ) -> Result<UniquePtr<Blocks>>;
        fn put_blocks(grid: Pin<&mut Grid>, blocks: Pin<&mut Blocks>) -> Result<()>;
        /// Bytes that a file of this grid takes at most.
        fn file_bound(grid: &Grid) -> u64;
        fn value_at(grid: &Grid, x: i32, y: i32, z: i32) -> f32;
        fn sample(grid: &Grid, call: &Call, world: &[f64], linear: bool, out: &mut [f32]) -> Result<()>;
        fn prune(grid: Pin<&mut Grid>, call: &Call, level_set: bool, tolerance: f32) -> Result<()>;
        fn flood_fill(grid: Pin<&mut Grid>, call: &Call) -> Result<()>;
        fn components(grid: &Grid, call: &Call) -> Result<Vec<u64>>;

        fn grids_to_bytes(
            grids: &[usize],
            compression: i32,
            half: bool,
            meta: &Vec<Meta>,
        ) -> Result<UniquePtr<CxxString>>;
        fn describe_file(path: &str) -> Result<Vec<GridHeader>>;
        fn describe_bytes(bytes: &[u8]) -> Result<Vec<GridHeader>>;
        fn read_float_grid(path: &str, name: &str) -> Result<UniquePtr<Grid>>;
        /// An empty name stands for the first level set, else the first float grid.
        fn float_grid_from_bytes(bytes: &[u8], name: &str) -> Result<UniquePtr<Grid>>;
        /// Transform and metadata, in OpenVDB's own coding.
        fn grid_head(grid: &Grid) -> Result<UniquePtr<CxxString>>;
        /// Every value above the leaves that is not an inactive background.
        fn tiles(grid: &Grid) -> Result<Vec<Tile>>;
        /// A grid without leaves.
        fn assemble(head: &[u8], background: f32, tiles: &[Tile]) -> Result<UniquePtr<Grid>>;
        /// Ends TBB's worker threads, unless somebody else uses them.
        fn end_workers();

        /// 0 union, 1 difference, 2 intersection; both grids are consumed into the first.
        fn csg(a: Pin<&mut Grid>, b: Pin<&mut Grid>, call: &Call, operation: i32) -> Result<()>;
        fn csg_copy(a: &Grid, b: &Grid, call: &Call, operation: i32) -> Result<UniquePtr<Grid>>;

        fn offset(grid: Pin<&mut Grid>, call: &Call, metres: f32, weno: bool) -> Result<()>;
        /// 0 mean, 1 gaussian.
        fn smooth(
            grid: Pin<&mut Grid>,
            call: &Call,
            kind: i32,
            width: i32,
            times: i32,
            weno: bool,
        ) -> Result<()>;
        fn renormalise(grid: Pin<&mut Grid>, call: &Call, weno: bool, times: i32) -> Result<()>;
        fn advect_outward(grid: Pin<&mut Grid>, call: &Call, speed: &Grid) -> Result<()>;

        fn from_mesh(
            call: &Call,
            points: &[f32],
            indices: &[u32],
            voxel: f64,
            half_width: f32,
        ) -> Result<UniquePtr<Grid>>;
        fn from_particles(
            call: &Call,
            positions: &[f64],
            radii: &[f32],
            voxel: f64,
            half_width: f32,
        ) -> Result<UniquePtr<Grid>>;
        fn to_mesh(grid: &Grid, call: &Call, iso: f64, adaptivity: f64, part: &Part) -> Result<Triangles>;
        fn measure(grid: &Grid, call: &Call, area: &mut f64, volume: &mut f64) -> Result<()>;
        fn cast_rays(grid: &Grid, call: &Call, rays: &[f64], hits: &mut [Hit]) -> Result<()>;
    }
}
