//! The gate of textures: what is rebuilt in a merge has those of the particles around it.
//!
//! Two balls meet and stay, each with a texture laid through it from the front. The particles' own texture is known by the set's motion: the
//! exact way back of a particle near a face leads to where its corners were at the first frame; there they have the texture of the
//! nearest position of the mesh then.

use frazil::geometry::check::deviation::NearestTree;
use frazil::geometry::{DVec3, DetailedMesh, TriMesh, Uvs, Vec3};
use frazil::mesh_repair::{Source, Traced, carry_attributes};
use frazil::surface::{Change, Rest};

use crate::common::liquids::context;
use crate::surface::rebuilt_sequences::{Frame, Sequence, joined, walk};

/// How far apart in the texture the islands of a mesh with a seam lie (its size).
const ISLAND: f32 = 8.0;
/// Particles count as near a face up to so much farther away than the nearest one (spacings). Where those of both balls do, its texture
/// may be either's.
const NEAR: f64 = 0.5;

pub fn measure() -> (f64, String) {
    let ctx = context(2);
    let sequence = joined(&ctx);
    let first = sequence.at(0);
    let rest = Rest::of(&first).expect("ids");
    let truth = Truth::of(&sequence, first.positions);
    let mut sheets = [false, true].map(|has_seam| Sheet::of(&sequence.mesh, has_seam));
    let ended = walk(&ctx, &sequence, |frame| {
        let Some(change) = &frame.report.change else { return };
        let positions =
            rest.of_change(&ctx, frame.particles, sequence.spacing, change).expect("first places");
        for sheet in &mut sheets {
            sheet.follow(frame, change, &positions, sequence.spacing);
            sheet.see(&truth, &frame.particles.positions, &change.sources);
        }
    });
    for sheet in &sheets {
        println!(
            "# {}, {}: {} rebuilt faces in {} frames, {:.1} % of them marked; edges differ by {:.2} %, in the frame in which they were \
             made {:.2} %, in the last frame {:.2} %; taken from the mesh before alone {:.2} %",
            sequence.name,
            sheet.name,
            sheet.rebuilt,
            sheet.frames,
            sheet.marked_percent(),
            sheet.all.percent(),
            sheet.made.percent(),
            sheet.last.percent(),
            sheet.of_before.percent()
        );
    }
    let worst = sheets.iter().map(|sheet| sheet.made.percent());
    let mut worst = worst.fold(0.0, |most: f64, next| if next > most || next.is_nan() { next } else { most });
    if let Some(error) = ended {
        println!("# {error}");
        worst = f64::INFINITY;
    }
    let most = |percent: fn(&Sheet) -> f64| sheets.iter().map(percent).fold(0.0, f64::max);
    let note = format!(
        "faces as they are made, but those that are marked, {:.1} % of all that are rebuilt; the worse of coordinates of vertices and of \
         corners. What was made is squeezed as the gap goes on closing: over all frames {:.0} %, taken from the mesh before alone {:.0} %",
        most(Sheet::marked_percent),
        most(|sheet| sheet.all.percent()),
        most(|sheet| sheet.of_before.percent())
    );
    (worst, note)
}

/// By how much edges of faces differ, and how long they are, in the texture.
#[derive(Default)]
struct Sums {
    off: f64,
    own: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.off += other.off;
        self.own += other.own;
    }

    fn percent(&self) -> f64 {
        100.0 * self.off / self.own
    }
}

type Pair = [f64; 2];

/// The way from each corner of a triangle to the next.
fn edges(corners: [Pair; 3]) -> [Pair; 3] {
    let edge = |from: Pair, to: Pair| [to[0] - from[0], to[1] - from[1]];
    let [a, b, c] = corners;
    [edge(a, b), edge(b, c), edge(c, a)]
}

fn length([u, v]: Pair) -> f64 {
    (u * u + v * v).sqrt()
}

/// Where a texture is laid through the mesh of the first frame: its low corner and its size (m).
fn frame_of(mesh: &TriMesh) -> (Vec3, f32) {
    let (low, high) = mesh.bounds().expect("a mesh");
    (low, (high - low).amax())
}

/// What is known of the liquid.
struct Truth {
    /// Positions at the first frame (m), by id.
    first: Vec<DVec3>,
    tree: NearestTree,
    low: DVec3,
    size: f64,
    /// m.
    spacing: f64,
}

impl Truth {
    fn of(sequence: &Sequence, first: Vec<DVec3>) -> Self {
        let (low, size) = frame_of(&sequence.mesh);
        Self {
            first,
            tree: NearestTree::new(&sequence.mesh),
            low: low.cast(),
            size: f64::from(size),
            spacing: sequence.spacing,
        }
    }

    /// The ways back to the first frame (m) of the particles near a position (m), which are at `now`: one for each ball.
    fn ways(&self, now: &[DVec3], position: DVec3) -> Vec<DVec3> {
        let nearest = |side: f64| {
            let all = now.iter().zip(&self.first).filter(|(_, first)| first.x * side > 0.0);
            let far = all.map(|(now, first)| ((now - position).norm(), first - now));
            far.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a ball")
        };
        let both = [nearest(-1.0), nearest(1.0)];
        let most = both[0].0.min(both[1].0) + NEAR * self.spacing;
        both.into_iter().filter(|(far, _)| *far <= most).map(|(_, way)| way).collect()
    }

    /// The particles' own edges, in the texture, of a triangle whose corners' way back is known (m).
    fn edges(&self, corners: &[DVec3; 3], way: DVec3) -> [Pair; 3] {
        edges(corners.map(|corner| {
            let position = self.tree.nearest(corner + way).expect("a mesh").position;
            [(position.x - self.low.x) / self.size, (position.y - self.low.y) / self.size]
        }))
    }
}

/// A mesh with a texture, as it goes on.
struct Sheet {
    name: &'static str,
    first: DetailedMesh,
    /// As it is now: through the particles' first positions, and from the mesh before alone.
    traced: DetailedMesh,
    before: DetailedMesh,
    /// Over all frames in which the mesh changed: how many these are, faces that were rebuilt, and those of them that are marked.
    frames: usize,
    rebuilt: usize,
    marked: usize,
    /// Of those that are not: all, as they were made, in the last of the frames; and all, taken from the mesh before alone.
    all: Sums,
    made: Sums,
    last: Sums,
    of_before: Sums,
}

impl Sheet {
    fn of(mesh: &TriMesh, has_seam: bool) -> Self {
        let (low, size) = frame_of(mesh);
        let position = |p: &Vec3| [(p.x - low.x) / size, (p.y - low.y) / size];
        let positions: Vec<[f32; 2]> = mesh.positions.iter().map(position).collect();
        let uvs = if has_seam {
            // What is seen from behind lies on an island of its own.
            let count = positions.len() as u32;
            let behind: Vec<[f32; 2]> = positions.iter().map(|[u, v]| [u + ISLAND, *v]).collect();
            let corners = mesh.triangles.iter().flat_map(|names| {
                let height: f32 = names.iter().map(|name| mesh.positions[*name as usize].z).sum();
                names.map(|name| if height < 0.0 { name + count } else { name })
            });
            Uvs { corners: Some(corners.collect()), coordinates: [positions, behind].concat(), missing: 0 }
        } else {
            Uvs { coordinates: positions, corners: None, missing: 0 }
        };
        let first = DetailedMesh { mesh: mesh.clone(), uvs: Some(uvs), arrays: Vec::new() };
        Self {
            name: if has_seam { "coordinates of corners, with a seam" } else { "coordinates of vertices" },
            traced: first.clone(),
            before: first.clone(),
            first,
            of_before: Sums::default(),
            rebuilt: 0,
            marked: 0,
            frames: 0,
            all: Sums::default(),
            made: Sums::default(),
            last: Sums::default(),
        }
    }

    /// The share of the rebuilt faces, over all frames, that is marked.
    fn marked_percent(&self) -> f64 {
        100.0 * self.marked as f64 / self.rebuilt as f64
    }

    /// Takes what it carries along a change, as the command does.
    fn follow(&mut self, frame: &Frame<'_>, change: &Change, places: &[Option<DVec3>], spacing: f64) {
        let positions: Vec<Vec3> = change.before.iter().map(|place| place.cast()).collect();
        let old = |was: &DetailedMesh| DetailedMesh {
            mesh: TriMesh { positions: positions.clone(), triangles: was.mesh.triangles.clone() },
            uvs: was.uvs.clone(),
            arrays: was.arrays.clone(),
        };
        let carried = |was: &DetailedMesh, traced: Option<&Traced<'_>>| {
            carry_attributes(&old(was), frame.tracker.mesh(), &change.origins, &change.sources, traced)
        };
        let traced = Traced { first: &self.first, tree: None, positions: places, spacing };
        let (through, alone) = (carried(&self.traced, Some(&traced)), carried(&self.before, None));
        (self.traced, self.before) = (through, alone);
    }

    /// Compares it with the particles' own texture, these being at `now` (m).
    fn see(&mut self, truth: &Truth, now: &[DVec3], sources: &[Source]) {
        let is_mask = |array: &&frazil::geometry::MeshArray| array.name == Traced::MASK;
        let mask = self.traced.arrays.iter().find(is_mask).expect("the mask").values.clone();
        self.frames += 1;
        self.last = Sums::default();
        for (face, mark) in mask.iter().enumerate().filter(|(_, mark)| **mark > 0.0) {
            self.rebuilt += 1;
            if *mark > 1.0 {
                self.marked += 1;
                continue;
            }
            let corners = self.traced.mesh.corners(face);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let own: Vec<[Pair; 3]> =
                truth.ways(now, middle).into_iter().map(|way| truth.edges(&corners, way)).collect();
            let sums = compared(&own, texture(&self.traced, face));
            self.all.add(&sums);
            self.last.add(&sums);
            if sources[face] == Source::New {
                self.made.add(&sums);
            }
            self.of_before.add(&compared(&own, texture(&self.before, face)));
        }
    }
}

/// The edges of a face in its texture.
fn texture(mesh: &DetailedMesh, face: usize) -> [Pair; 3] {
    let uvs = mesh.uvs.as_ref().expect("a texture");
    let indices = uvs.indices(&mesh.mesh.triangles, face);
    edges(indices.map(|index| uvs.coordinates[index as usize].map(f64::from)))
}

/// By how much edges differ from the particles' own: of several the nearest.
fn compared(own: &[[Pair; 3]], found: [Pair; 3]) -> Sums {
    let one = |own: &[Pair; 3]| {
        let off = own.iter().zip(&found).map(|(own, found)| length([found[0] - own[0], found[1] - own[1]]));
        Sums { off: off.sum(), own: own.iter().map(|edge| length(*edge)).sum() }
    };
    own.iter().map(one).min_by(|a, b| a.off.total_cmp(&b.off)).unwrap_or_default()
}
