//! Closed parts are turned outward, doubled faces count once, and what cannot be decided is said.

use std::sync::Arc;

use crate::common::oriented::{Kind, case, loose};
use crate::common::shapes;
use frazil::Result;
use frazil::geometry::check::orientation::{Closing, Orientation};
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::motion::{Keys, Motion, Rigid};
use frazil::shallow::terrain::facing::facing;
use frazil::sweep::Body;

const BOTH: [Closing; 2] = [Closing::Caps, Closing::Below];

fn cube(at: f32, size: f32) -> TriMesh {
    TriMesh::cuboid([at; 3], [at + size; 3])
}

fn all(parts: &[TriMesh]) -> TriMesh {
    let mut mesh = TriMesh::default();
    parts.iter().for_each(|part| mesh.append(part));
    mesh
}

#[test]
fn meshes_mean_what_they_were_made_of_however_they_are_turned() {
    for seed in 0..120 {
        let case = case(seed);
        for closing in BOTH {
            let orientation = Orientation::of_mesh(&case.mesh, closing);
            let name = format!("{}, {closing:?}: {:?}", case.name, orientation.warning());
            assert_eq!(orientation.warning().is_some(), case.kind == Kind::Doubtful, "{name}");
            assert!(!orientation.has_open() || case.kind == Kind::Doubtful, "{name}");
            assert!(case.kind != Kind::Correct || orientation.is_unchanged(), "{name}");
            if case.kind == Kind::Doubtful {
                continue;
            }
            let made = orientation.applied_to(case.mesh.clone());
            assert!((made.volume() / case.volume - 1.0).abs() < 0.01, "{name}: {} m3", made.volume());
            assert!(Orientation::of_mesh(&made, closing).is_unchanged(), "{name}");
        }
    }
}

#[test]
fn parts_are_turned_but_for_cavities_wherever_they_lie() {
    let of = |parts: &[TriMesh]| {
        let mesh = all(parts);
        let volumes = [mesh.clone(), loose(&mesh)].map(|mesh| {
            // Far from the origin, too.
            let mut far = mesh.clone();
            far.positions.iter_mut().for_each(|p| *p += Vec3::new(4096.0, -512.0, 1024.0));
            let near = Orientation::of_mesh(&mesh, Closing::Caps);
            assert_eq!(
                near.applied(&mesh.triangles),
                Orientation::of_mesh(&far, Closing::Caps).applied(&mesh.triangles)
            );
            assert_eq!(near.warning(), None);
            near.applied_to(mesh).volume()
        });
        assert!((volumes[0] - volumes[1]).abs() < 1e-9);
        volumes[0]
    };
    let (out, cavity) = (cube(0.0, 4.0), cube(1.0, 2.0).reversed());
    assert_eq!(of(&[out.clone(), cavity.clone()]), 56.0);
    assert_eq!(of(&[out.clone().reversed(), cavity.clone().reversed()]), 56.0);
    assert_eq!(of(&[out.clone(), cavity.clone(), cube(1.5, 1.0)]), 57.0);
    // A solid in a cavity that is inside out.
    assert_eq!(of(&[out.clone(), cavity.clone(), cube(1.5, 1.0).reversed()]), 57.0);
    // What sticks out, or only touches, is no cavity.
    assert_eq!(of(&[out.clone(), cube(3.0, 2.0).reversed()]), 72.0);
    assert_eq!(of(&[out.clone(), cube(4.0, 1.0).reversed()]), 65.0);
    let on_it = TriMesh::cuboid([1.0, 4.0, 1.0], [3.0, 6.0, 3.0]).reversed();
    assert_eq!(of(&[out.clone(), on_it]), 72.0);
    // A solid within a solid is none either, while it is right side out.
    assert_eq!(of(&[out, cube(1.0, 2.0)]), 72.0);
}

#[test]
fn sheets_stay_and_walls_between_solids_too() {
    let sheet = TriMesh {
        positions: [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]].map(Vec3::from).to_vec(),
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    };
    for mesh in [sheet.clone(), sheet.clone().reversed()] {
        for closing in BOTH {
            let orientation = Orientation::of_mesh(&mesh, closing);
            assert!(orientation.is_unchanged() && orientation.has_open() && orientation.warning().is_none());
        }
    }
    // Both sides of a sheet: one is left, which faces up.
    let mut both = sheet.clone().reversed();
    both.triangles.extend(&sheet.triangles);
    let up = Orientation::of_mesh(&both, Closing::Below).applied(&both.triangles);
    assert_eq!(up, sheet.triangles.iter().map(|&[a, b, c]| [a, b, c]).collect::<Vec<_>>());
    // Two boxes that share the corners of a wall.
    let wall = shapes::welded(&all(&[cube(0.0, 1.0), TriMesh::cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])]));
    let orientation = Orientation::of_mesh(&wall, Closing::Caps);
    assert!(orientation.is_unchanged() && orientation.warning().is_none());
    // A ground and a block on it, both turned round: the ground turns with the block.
    let block = TriMesh::cuboid([0.2, -0.1, 0.2], [0.8, 0.5, 0.8]);
    let scene = all(&[sheet, block]);
    assert_eq!(facing(&scene.clone().reversed()).applied(&scene.clone().reversed().triangles).len(), 14);
    let turned = scene.clone().reversed();
    assert_eq!(facing(&turned).applied_to(turned.clone()).corners(0), scene.corners(0).map(|p| p));
    assert!(facing(&scene).is_unchanged());
}

/// A mesh whose second part is turned inside out at 1 s.
struct Turning(TriMesh);

impl Motion for Turning {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.0.triangles
    }

    fn vertex_count(&self) -> usize {
        self.0.positions.len()
    }

    fn breaks(&self, _from: f64, _to: f64) -> Vec<f64> {
        Vec::new()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let side = |at: usize| if at < 8 { 1.0 } else { 1.0 - 2.0 * time };
        out.clear();
        out.extend(
            self.0
                .positions
                .iter()
                .enumerate()
                .map(|(at, p)| DVec3::new(f64::from(p.x) * side(at), p.y.into(), p.z.into())),
        );
        Ok(())
    }
}

#[test]
fn a_shape_is_decided_once() {
    let mesh = all(&[cube(0.0, 2.0), cube(3.0, 1.0)]);
    let shape = Body::new(Box::new(Turning(mesh.clone())), 0.0).unwrap().shape().clone();
    let later = Body::shaped(Box::new(Turning(mesh.clone())), 1.0, Some(shape.clone())).unwrap();
    assert!(Arc::ptr_eq(later.shape(), &shape) && later.triangles() == mesh.triangles);
    // Without what was known it is turned in that pose.
    let own = Body::new(Box::new(Turning(mesh.clone())), 1.0).unwrap();
    assert_eq!(own.triangles()[..12], mesh.triangles[..12]);
    assert_eq!(own.triangles()[12], {
        let [a, b, c] = mesh.triangles[12];
        [a, c, b]
    });
    let still = Body::new(Box::new(Rigid::new(mesh.clone().reversed(), Keys::default())), 0.0).unwrap();
    assert_eq!(still.triangles(), mesh.triangles);
}
