//! Meshes with faults become the solids that they mean, and what has none stays as it is.

use std::f64::consts::PI;

use frazil::geometry::check::faults::Faults;
use frazil::geometry::check::topology::Topology;
use frazil::geometry::mesh::coincident;
use frazil::geometry::{TriMesh, Vec3};
use frazil::mesh_repair::{RepairReport, Repaired, Source, repair};

use crate::common::bodies::{icosphere, models};
use crate::common::broken_meshes::{self, Broken};
use crate::common::liquids::context;
use crate::common::repaired::{NOTHING, failures, faults};
use crate::common::shapes;

/// As many as `FRAZIL_FUZZ` says; gate `surface.repair_fuzz` tries 10,000.
#[test]
fn meshes_with_many_faults_become_the_solids_that_they_mean() {
    let count = std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(150);
    let failed = failures(0..count, &models(), |_| {});
    assert!(failed.is_empty(), "{} of {count}:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn what_is_meant_by_meshes_with_faults_is_closed() {
    let models = models();
    let mut faulty = 0;
    for seed in 0..100 {
        let Broken { mesh, what, parts, .. } = broken_meshes::mesh(seed, &models);
        mesh.validate().unwrap();
        assert!(mesh.triangles.len() <= 20_000, "{what}");
        faulty += usize::from(!Topology::of(mesh.positions.len(), &mesh.triangles).is_watertight());
        for part in &parts {
            let same = coincident(part.positions.iter().map(|position| position.cast()));
            let triangles =
                part.triangles.iter().map(|triangle| triangle.map(|corner| same[corner as usize]));
            let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
            let joined = TriMesh { positions: part.positions.clone(), triangles };
            assert!(joined.is_closed() && joined.volume() > 0.0, "seed {seed}: {what}");
        }
    }
    assert!(faulty > 40, "{faulty} have faults by index");
}

fn moved(mesh: &TriMesh, by: [f32; 3]) -> TriMesh {
    let positions = mesh.positions.iter().map(|position| position + Vec3::from(by)).collect();
    TriMesh { positions, triangles: mesh.triangles.clone() }
}

fn scaled(mesh: &TriMesh, by: f32) -> TriMesh {
    let positions = mesh.positions.iter().map(|position| position * by).collect();
    TriMesh { positions, triangles: mesh.triangles.clone() }
}

fn both(first: &TriMesh, second: &TriMesh) -> TriMesh {
    let mut mesh = first.clone();
    mesh.append(second);
    mesh
}

/// Whether a repaired mesh is another one, whose triangles are the first of the mesh that came in, each as it was or turned.
fn is_kept(repaired: &Repaired, mesh: &TriMesh) -> bool {
    let least_first = |mut triangle: [u32; 3]| {
        let least = (0..3).min_by_key(|at| triangle[*at]).unwrap_or(0);
        triangle.rotate_left(least);
        triangle
    };
    let is_same = |(triangle, source): (&[u32; 3], &Source)| {
        let Source::Whole(from) = source else { return false };
        let was = mesh.triangles.get(*from as usize);
        was.is_some_and(|was| least_first(*was) == least_first(*triangle))
    };
    let Repaired { mesh: after, vertices, sources, .. } = repaired;
    after.positions == mesh.positions
        && vertices.iter().zip(0..).all(|(from, vertex)| *from == Some(vertex))
        && after.triangles.len() == mesh.triangles.len()
        && after.triangles.iter().zip(sources).all(is_same)
}

#[test]
fn two_spheres_that_overlap_are_one_and_mostly_as_they_were() {
    let ball = icosphere(4);
    let mesh = both(&moved(&ball, [-0.5, 0.02, 0.01]), &moved(&ball, [0.5, 0.02, 0.01]));
    let repaired = repair(&context(2), &mesh, 0.05).unwrap();
    let faults = Faults::of(&repaired.mesh);
    assert!(faults.by_index.is_watertight(), "{faults:?}");
    assert_eq!((faults.parts, faults.genus), (1, Some(0)));
    // Two unit spheres a radius apart have a lens in common; theirs are of triangles, and smaller.
    let (whole, lens) = (4.0 / 3.0 * PI, 5.0 / 12.0 * PI);
    let wanted = (2.0 * whole - lens) * ball.volume() / whole;
    let volume = repaired.mesh.volume();
    assert!((volume / wanted - 1.0).abs() < 0.01, "{volume} for {wanted}");
    let kept = repaired.sources.iter().filter(|source| matches!(source, Source::Whole(_))).count();
    assert_eq!(kept, repaired.report.kept_triangles);
    assert!(2 * kept > repaired.mesh.triangles.len() && 2 * kept > mesh.triangles.len(), "{kept} kept");
    assert!(repaired.report.flagged_cells > 0 && repaired.report.rebuilt_cells > 0, "{:?}", repaired.report);
}

#[test]
fn a_cube_inside_out_is_turned() {
    let cube = TriMesh::cuboid([-1.0; 3], [1.0; 3]);
    let repaired = repair(&context(2), &cube.clone().reversed(), 0.25).unwrap();
    assert!(is_kept(&repaired, &cube), "{:?}", repaired.report);
    assert_eq!((repaired.mesh.volume(), repaired.report.rebuilt_cells), (8.0, 0));
}

#[test]
fn a_sphere_with_another_inside_is_one_whatever_way_they_are_turned() {
    let (outer, inner) = (icosphere(3), scaled(&icosphere(3), 0.5));
    for turned in 0..4 {
        let turned_if = |mesh: &TriMesh, is: bool| if is { mesh.clone().reversed() } else { mesh.clone() };
        let mesh = both(&turned_if(&outer, turned & 1 == 1), &turned_if(&inner, turned & 2 == 2));
        let repaired = repair(&context(2), &mesh, 0.1).unwrap();
        assert!(is_kept(&repaired, &outer), "{turned}: {:?}", repaired.report);
    }
}

#[test]
fn a_mesh_without_faults_stays_as_it_is() {
    let meshes = [shapes::torus(1.0, 0.3, 48, 24), icosphere(3), TriMesh::cuboid([0.0; 3], [1.0, 0.05, 0.7])];
    for mesh in meshes {
        let repaired = repair(&context(2), &mesh, 0.1).unwrap();
        assert!(repaired.mesh == mesh && is_kept(&repaired, &mesh), "{:?}", repaired.report);
        let RepairReport { rebuild_level, flagged_cells, rebuilt_cells, kept_triangles, .. } =
            repaired.report;
        assert_eq!(
            (rebuild_level, flagged_cells, rebuilt_cells, kept_triangles),
            (0, 0, 0, mesh.triangles.len())
        );
    }
}

#[test]
fn what_encloses_nothing_is_refused() {
    let ctx = context(1);
    let sheet = TriMesh {
        positions: vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.0)],
        triangles: vec![[0, 1, 2], [1, 3, 2]],
    };
    let lone = TriMesh { triangles: vec![[0, 1, 2]], ..sheet.clone() };
    for mesh in [lone, sheet] {
        assert_eq!(repair(&ctx, &mesh, 0.1).err().map(|error| error.to_string()).as_deref(), Some(NOTHING));
    }
    let cube = TriMesh::cuboid([0.0; 3], [1.0; 3]);
    for cell in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(repair(&ctx, &cube, cell).is_err(), "{cell}");
    }
}

#[test]
fn one_and_two_threads_make_the_same_bytes() {
    let mut count = 0;
    for seed in 0..16 {
        let broken = broken_meshes::mesh(seed, &[]);
        let [one, two] = [1, 2].map(|threads| repair(&context(threads), &broken.mesh, broken.cell));
        match (one, two) {
            (Ok(one), Ok(two)) => {
                let is_same =
                    one.mesh == two.mesh && one.vertices == two.vertices && one.sources == two.sources;
                assert!(is_same, "seed {seed}: {}", broken.what);
                count += 1;
            }
            (one, two) => {
                let [one, two] = [one, two].map(|result| result.err().map(|error| error.to_string()));
                assert_eq!(one, two, "seed {seed}: {}", broken.what);
            }
        }
    }
    assert!(count > 12, "{count} are repaired");
}

#[test]
fn what_is_moved_by_whole_cells_is_repaired_alike() {
    let (cell, ball) = (0.0625f32, icosphere(3));
    let mut mesh = both(&moved(&ball, [-0.4, 0.03, 0.0]), &moved(&ball, [0.41, 0.0, 0.06]));
    // Multiples of a power of two: moving them rounds nothing.
    mesh.positions
        .iter_mut()
        .for_each(|position| *position = position.map(|x| (x * 65_536.0).round() / 65_536.0));
    let by = Vec3::new(7.0, -3.0, 13.0) * cell;
    let [here, there] =
        [&mesh, &moved(&mesh, by.into())].map(|mesh| repair(&context(2), mesh, cell.into()).unwrap().mesh);
    let counts = [&here, &there].map(|mesh| mesh.positions.len());
    // Slivers are taken out block by block of the grid, and these lie otherwise.
    assert!(counts[0].abs_diff(counts[1]) < 8, "{counts:?}");
    let is_there =
        |position: &&Vec3| there.positions.iter().any(|other| (other - by - **position).amax() < 1e-4 * cell);
    let found = here.positions.iter().filter(is_there).count();
    assert!(found + 40 > here.positions.len(), "{found} of {}", here.positions.len());
    assert!((there.volume() / here.volume() - 1.0).abs() < 1e-5, "{} {}", here.volume(), there.volume());
}

/// A mesh as if all of it had been made.
fn made(mesh: TriMesh) -> Repaired {
    Repaired {
        vertices: vec![None; mesh.positions.len()],
        sources: vec![Source::New; mesh.triangles.len()],
        mesh,
        report: RepairReport::default(),
    }
}

/// The check that the fuzz relies on.
#[test]
fn what_is_wrong_with_a_repaired_mesh_is_seen() {
    let ball = icosphere(3);
    let inner = scaled(&ball, 0.5);
    let meant = |parts: &[&TriMesh]| {
        let mut mesh = TriMesh::default();
        parts.iter().for_each(|part| mesh.append(part));
        let parts = parts.iter().map(|part| (*part).clone()).collect();
        Broken { mesh, cell: 0.1, what: String::new(), parts, unclear: Vec::new() }
    };
    let one = meant(&[&ball]);
    let says = |broken: &Broken, repaired: Repaired, word: &str| {
        let fault = faults(broken, &repaired).unwrap_or_default();
        assert!(fault.contains(word) && fault.is_empty() == word.is_empty(), "{fault}, not {word}");
    };
    says(&one, made(ball.clone()), "");
    says(&one, made(scaled(&ball, 1.05)), "");
    says(&one, made(scaled(&ball, 1.2)), "lies over a cell from the surface");
    says(&one, made(TriMesh::default()), "nothing is left");
    says(&one, made(ball.clone().reversed()), "its volume is -");
    let mut open = ball.clone();
    open.triangles.pop();
    says(&one, made(open), "not watertight");
    let mut sliver = ball.clone();
    let [a, b, _] = ball.triangles[0].map(|corner| corner as usize);
    sliver.positions[b] = ball.positions[a] + (ball.positions[b] - ball.positions[a]) * 1e-5;
    says(&one, made(sliver), "m high");
    // Kept, but in another position, and not as it was.
    let kept = |mesh: &TriMesh| Repaired {
        vertices: (0..mesh.positions.len() as u32).map(Some).collect(),
        sources: (0..mesh.triangles.len() as u32).map(Source::Whole).collect(),
        ..made(mesh.clone())
    };
    says(&one, kept(&ball), "");
    says(&one, kept(&moved(&ball, [1e-3, 0.0, 0.0])), "is not where vertex 0 was");
    let mut other = kept(&ball);
    other.sources.swap(3, 4);
    says(&one, other, "is not what triangle 4 was");
    // All is where something is meant to be, but the one within the other is not the solid.
    says(&meant(&[&ball, &inner]), kept(&both(&ball, &inner)), "the winding number is 2");
    says(&meant(&[&ball, &inner]), kept(&both(&ball, &inner.clone().reversed())), "the winding number is 0");
    says(&meant(&[&ball, &inner]), kept(&ball), "");
}
