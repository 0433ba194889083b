//! The only bridge to C++: declarations, no logic.

#[cxx::bridge(namespace = "frazil")]
pub(super) mod ffi {
    /// The position of a leaf in memory.
    struct LeafView {
        x: i32,
        y: i32,
        z: i32,
        /// Whether `values` and `mask` are set; if not, `tile_active` and `tile` are.
        is_leaf: bool,
        tile_active: bool,
        /// A grid of floats uses only the first number.
        tile: [f32; 3],
        values: usize,
        mask: usize,
    }

    /// A metadata entry; `kind` selects the valid value.
    struct Meta {
        key: String,
        /// "string", "float", "double", "int", "bool", or the name of another type, whose value is then text.
        kind: String,
        text: String,
        number: f64,
        integer: i64,
    }

    /// The description of a grid in a file.
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

    /// A tile above the leaves.
    struct Tile {
        x: i32,
        y: i32,
        z: i32,
        /// 1 for a tile of 8 voxels along an edge, 2 for 128, 3 for 4096.
        level: u32,
        active: bool,
        /// A grid of floats uses only the first number.
        value: [f32; 3],
    }

    /// An attribute of points to be stored.
    struct PointArray {
        name: String,
        /// Its type, as `kind` of `vdb/point_arrays.rs` numbers it.
        kind: i32,
        /// Whether all points share one value.
        uniform: bool,
        /// Address of the values.
        address: usize,
    }

    /// An attribute of stored points.
    struct PointAttribute {
        name: String,
        /// OpenVDB's name of its type.
        type_name: String,
        /// As in `PointArray`, or -1 for a type that frazil does not support.
        kind: i32,
        uniform: bool,
    }

    /// Description of stored points.
    struct PointsHead {
        name: String,
        count: usize,
        voxel: f64,
        /// Whether `to_world` is the whole transform.
        is_linear: bool,
        /// From index space to the world (m): rows of a matrix that multiplies row vectors from the right.
        to_world: [f64; 16],
        attributes: Vec<PointAttribute>,
    }

    /// A grid from a file: one of the three, or none if it is of another type.
    struct Found {
        floats: UniquePtr<Grid>,
        vectors: UniquePtr<VectorGrid>,
        points: UniquePtr<PointGrid>,
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

    /// The part of a grid to mesh: all of it, the blocks at some origins, or, without origins, the voxels of a box.
    struct Part {
        whole: bool,
        /// Three numbers each.
        origins: Vec<i32>,
        /// Minimum and maximum voxel, both inclusive.
        low: [i32; 3],
        high: [i32; 3],
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
        fn shift(grid: Pin<&mut Grid>, by: [f64; 3]) -> Result<()>;
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
        /// Upper bound on the bytes of a file of this grid.
        fn file_bound(grid: &Grid) -> u64;
        fn value_at(grid: &Grid, x: i32, y: i32, z: i32) -> f32;
        fn sample(grid: &Grid, call: &Call, world: &[f64], linear: bool, out: &mut [f32]) -> Result<()>;
        fn prune(grid: Pin<&mut Grid>, call: &Call, level_set: bool, tolerance: f32) -> Result<()>;
        fn flood_fill(grid: Pin<&mut Grid>, call: &Call) -> Result<()>;
        fn dilate(grid: Pin<&mut Grid>, call: &Call) -> Result<()>;
        fn components(grid: &Grid, call: &Call) -> Result<Vec<u64>>;

        /// Whether every value of the grid at an address is finite when converted to 16 bits.
        fn fits_half(grid: usize, vectors: bool) -> Result<bool>;
        /// `vectors[i]` says whether `grids[i]` is the address of a `VectorGrid` rather than of a `Grid`.
        fn grids_to_bytes(
            grids: &[usize],
            vectors: &[bool],
            compression: i32,
            half: bool,
            meta: &Vec<Meta>,
        ) -> Result<UniquePtr<CxxString>>;
        fn describe_file(path: &str) -> Result<Vec<GridHeader>>;
        fn read_grid(path: &str, name: &str) -> Result<Found>;
        type Stored;
        fn read_bytes(bytes: &[u8]) -> Result<UniquePtr<Stored>>;
        fn describe_stored(stored: &Stored) -> Result<Vec<GridHeader>>;
        /// The grid with this index in the description; it can be taken once.
        fn take_stored(stored: Pin<&mut Stored>, index: usize) -> Result<Found>;
        /// Transform and metadata, in OpenVDB's own encoding.
        fn grid_head(grid: &Grid) -> Result<UniquePtr<CxxString>>;
        /// Every tile above the leaves except inactive background.
        fn tiles(grid: &Grid) -> Result<Vec<Tile>>;
        /// A grid without leaves.
        fn assemble(head: &[u8], background: f32, tiles: &[Tile]) -> Result<UniquePtr<Grid>>;

        type VectorGrid;
        fn make_vector_grid(voxel: f64, background: [f32; 3]) -> Result<UniquePtr<VectorGrid>>;
        fn vector_background(grid: &VectorGrid) -> [f32; 3];
        #[cxx_name = "copy_grid"]
        fn copy_vector_grid(grid: &VectorGrid) -> Result<UniquePtr<VectorGrid>>;
        #[cxx_name = "voxel_size"]
        fn vector_voxel_size(grid: &VectorGrid) -> f64;
        #[cxx_name = "index_to_world"]
        fn vector_index_to_world(grid: &VectorGrid, index: [f64; 3]) -> [f64; 3];
        #[cxx_name = "grid_class"]
        fn vector_class(grid: &VectorGrid) -> i32;
        #[cxx_name = "shift"]
        fn shift_vectors(grid: Pin<&mut VectorGrid>, by: [f64; 3]) -> Result<()>;
        #[cxx_name = "set_grid_class"]
        fn set_vector_class(grid: Pin<&mut VectorGrid>, number: i32) -> Result<()>;
        #[cxx_name = "name"]
        fn vector_name(grid: &VectorGrid) -> String;
        #[cxx_name = "set_name"]
        fn set_vector_name(grid: Pin<&mut VectorGrid>, name: &str) -> Result<()>;
        #[cxx_name = "active_voxels"]
        fn vector_active_voxels(grid: &VectorGrid) -> u64;
        #[cxx_name = "leaf_count"]
        fn vector_leaf_count(grid: &VectorGrid) -> usize;
        #[cxx_name = "memory_bytes"]
        fn vector_memory_bytes(grid: &VectorGrid) -> u64;
        #[cxx_name = "file_bound"]
        fn vector_file_bound(grid: &VectorGrid) -> u64;
        #[cxx_name = "active_bbox"]
        fn vector_active_bbox(grid: &VectorGrid, low: &mut [i32; 3], high: &mut [i32; 3]) -> Result<bool>;
        #[cxx_name = "leaves"]
        fn vector_leaves(grid: &VectorGrid) -> Result<Vec<LeafView>>;
        #[cxx_name = "probe"]
        fn vector_probe(grid: &VectorGrid, origins: &[i32]) -> Result<Vec<LeafView>>;
        #[cxx_name = "grid_head"]
        fn vector_head(grid: &VectorGrid) -> Result<UniquePtr<CxxString>>;
        #[cxx_name = "tiles"]
        fn vector_tiles(grid: &VectorGrid) -> Result<Vec<Tile>>;
        type VectorBlocks;
        /// As `make_blocks`: 512 x 3 floats, and three for a constant.
        fn make_vector_blocks(
            call: &Call,
            origins: &[i32],
            values: &[usize],
            masks: &[usize],
            constants: &[f32],
        ) -> Result<UniquePtr<VectorBlocks>>;
        fn put_vector_blocks(grid: Pin<&mut VectorGrid>, blocks: Pin<&mut VectorBlocks>) -> Result<()>;
        /// Three floats for each position.
        fn sample_vectors(
            grid: &VectorGrid,
            call: &Call,
            world: &[f64],
            linear: bool,
            out: &mut [f32],
        ) -> Result<()>;
        fn assemble_vectors(
            head: &[u8],
            background: [f32; 3],
            tiles: &[Tile],
        ) -> Result<UniquePtr<VectorGrid>>;

        type PointGrid;
        /// Points; the first array has the positions within their voxels. `order` lists the points by leaf and voxel, or is empty if they
        /// are already in that order; `starts` are the indices in it of the first point of each leaf.
        fn make_points(
            call: &Call,
            voxel: f64,
            name: &str,
            cells: &[i32],
            arrays: &[PointArray],
            order: &[u32],
            starts: &[usize],
        ) -> Result<UniquePtr<PointGrid>>;
        fn points_to_bytes(
            grid: &PointGrid,
            compression: i32,
            meta: &Vec<Meta>,
        ) -> Result<UniquePtr<CxxString>>;
        fn points_head(grid: &PointGrid, call: &Call) -> Result<PointsHead>;
        /// Three numbers for each point.
        fn point_cells(grid: &PointGrid, call: &Call, out: &mut [i32]) -> Result<()>;
        /// Writes `count` values of an attribute to an address: one for each point, or one if the attribute is uniform.
        ///
        /// # Safety
        /// The memory at the address must hold `count` values of this kind.
        unsafe fn point_values(
            grid: &PointGrid,
            call: &Call,
            attribute: &str,
            kind: i32,
            address: usize,
            count: usize,
        ) -> Result<()>;

        /// Ends TBB's worker threads, unless others use them.
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
    }
}
