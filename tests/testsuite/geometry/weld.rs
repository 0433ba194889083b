//! Which corners of triangle soup are one: solids by code with corners that are off by rounding, and what must stay apart.

use frazil::geometry::mesh::coincident;
use frazil::geometry::mesh::weld::Weld;
use frazil::geometry::{DVec3, TriMesh, Vec3};

use crate::common::bodies::Dice;
use crate::common::soups::solids;

fn weld(mesh: &TriMesh) -> Weld {
    let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
    Weld::of(&positions, &mesh.triangles)
}

fn welded(mesh: &TriMesh, weld: &Weld) -> TriMesh {
    let triangles = mesh.triangles.iter().map(|corners| corners.map(|vertex| weld.firsts[vertex as usize]));
    TriMesh { positions: mesh.positions.clone(), triangles: triangles.collect() }
}

/// Each triangle with corners of its own.
fn soup_of(mesh: &TriMesh) -> TriMesh {
    let positions = mesh.triangles.as_flattened().iter().map(|&vertex| mesh.positions[vertex as usize]);
    let triangles = (0..mesh.triangles.len() as u32).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect();
    TriMesh { positions: positions.collect(), triangles }
}

fn up(value: f32, steps: usize) -> f32 {
    (0..steps).fold(value, |value, _| value.next_up())
}

#[test]
fn soup_that_is_off_by_rounding_is_the_solid_that_it_was_made_of() {
    let mut dice = Dice(4);
    let bodies = solids(&mut dice);
    for (size, far) in [(1.0, 0.0), (0.01, 0.0), (1.0, 1.0), (1.0, 1e3), (4.0, 1e4), (40.0, 1e5)] {
        for solid in &bodies {
            for steps in 0..=4 {
                let at = dice.direction() * far;
                let soup = solid.soup(size, at, steps, &mut dice);
                let what = format!("{} of {size} m at {at}, {steps} steps", solid.name);
                let weld = weld(&soup);
                let whole = welded(&soup, &weld);
                assert!(whole.is_closed() && weld.ambiguous.is_empty(), "{what}: {weld:?}");
                let ratio = whole.volume() / (solid.volume * size.powi(3));
                assert!((ratio - 1.0).abs() < 0.01, "{what}: {ratio}");
                let positions = soup.positions.iter().map(|position| position.cast());
                // Soup that closes where corners are equal keeps the order that this gives.
                assert!(steps > 0 || weld.firsts == coincident(positions), "{what}");
                assert!(weld.firsts.iter().enumerate().all(|(vertex, &first)| first as usize <= vertex));
                let mut same = soup.positions.clone();
                weld.unify(&mut same);
                assert!((0..same.len()).all(|vertex| same[vertex] == same[weld.firsts[vertex] as usize]));
            }
        }
    }
}

#[test]
fn zero_and_what_a_turn_leaves_of_it_are_one() {
    let mut mesh = soup_of(&TriMesh::cuboid([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]));
    let noise = [0.0, -0.0, 1e-12, -3e-8, 1.2e-7];
    let mut next = (0..).map(|at| noise[at % noise.len()]);
    mesh.positions
        .iter_mut()
        .filter(|position| position.y == 0.0)
        .for_each(|position| position.y = next.next().unwrap());
    let weld = weld(&mesh);
    assert!(welded(&mesh, &weld).is_manifold() && weld.ambiguous.is_empty(), "{weld:?}");
}

/// A cuboid whose top has come off by so many steps.
fn with_slit(steps: usize) -> TriMesh {
    let mut mesh = TriMesh::cuboid([-0.5, 0.5, -0.5], [0.5, 1.5, 0.5]);
    let is_top = |position: &Vec3| position.y == 1.5;
    let old = mesh.positions.clone();
    mesh.positions
        .extend(old.iter().map(|position| Vec3::new(position.x, up(position.y, steps), position.z)));
    for corners in
        mesh.triangles.iter_mut().filter(|corners| corners.iter().all(|at| is_top(&old[*at as usize])))
    {
        *corners = corners.map(|vertex| vertex + 8);
    }
    mesh
}

#[test]
fn a_slit_is_closed_up_to_four_steps_and_stays_beyond() {
    for steps in 1..=4 {
        let mesh = with_slit(steps);
        let weld = weld(&mesh);
        assert!(welded(&mesh, &weld).is_manifold() && weld.near.len() == 4, "{steps}");
    }
    for steps in [5, 6, 16, 1000] {
        let mesh = with_slit(steps);
        let weld = weld(&mesh);
        assert!(
            weld.near.is_empty() && weld.ambiguous.is_empty() && weld.warning().is_none(),
            "{steps}: {weld:?}"
        );
    }
    // Far away along another axis, where coordinates are coarse: those along this one are as fine as they were.
    let mut far = with_slit(16);
    far.positions.iter_mut().for_each(|position| position.x += 65536.0);
    assert!(weld(&far).near.is_empty());
}

#[test]
fn open_meshes_stay_as_they_are() {
    let mut box_without_lid = TriMesh::cuboid([0.0; 3], [1.0; 3]);
    box_without_lid.triangles.truncate(10);
    for mesh in [box_without_lid.clone(), soup_of(&box_without_lid)] {
        let positions = mesh.positions.iter().map(|position| position.cast());
        assert_eq!(weld(&mesh), Weld { firsts: coincident(positions), ..Weld::default() });
    }
}

#[test]
fn the_ends_of_an_edge_are_never_one() {
    // A sliver across a square: its short edge is 2 steps long, all corners are off by a step.
    let sliver = up(1.0, 2);
    let corner = |x: f32, y: f32| Vec3::new(x, y, 1.0);
    let mut dice = Dice(9);
    for _ in 0..100 {
        let sheet = TriMesh {
            positions: vec![
                corner(0.0, 0.0),
                corner(1.0, 0.0),
                corner(1.0, 1.0),
                corner(sliver, 1.0),
                corner(2.0, 0.0),
            ],
            triangles: vec![[0, 1, 2], [1, 3, 2], [1, 4, 3]],
        };
        let mut soup = soup_of(&sheet);
        for position in &mut soup.positions {
            *position = position.map(|value| up(value, dice.below(2)));
        }
        let weld = weld(&soup);
        let whole = welded(&soup, &weld);
        assert!(whole.triangles.iter().all(|[a, b, c]| a != b && b != c && c != a), "{weld:?}");
    }
}

#[test]
fn what_rounding_does_not_decide_is_warned_of() {
    // Cells of 8 mm, where neighbouring numbers are 7.8 mm apart.
    let mut dice = Dice(3);
    let mut small = solids(&mut dice).swap_remove(4);
    small.positions.iter_mut().for_each(|position| *position *= 0.5);
    let soup = small.soup(1.0, DVec3::new(1e5, 1e5, 1e5), 4, &mut dice);
    let weld = weld(&soup);
    assert!(!welded(&soup, &weld).is_manifold());
    let said = weld.warning().unwrap();
    assert!(said.contains("within rounding of others") && said.contains("vertex"), "{said}");
}

#[test]
fn a_chain_that_closes_is_joined_and_warned_of() {
    // Three corners in a row, the ends 6 steps apart: a cone's tip that its triangles share.
    let mut mesh = TriMesh {
        positions: vec![Vec3::new(1.5, 3.0, 1.5); 3],
        triangles: vec![[0, 3, 4], [1, 4, 5], [2, 5, 3], [5, 4, 3]],
    };
    mesh.positions.extend([Vec3::new(1.2, 2.0, 1.2), Vec3::new(1.5, 2.0, 1.8), Vec3::new(1.8, 2.0, 1.2)]);
    let whole = weld(&mesh);
    assert!(welded(&mesh, &whole).is_manifold() && whole.warning().is_none());
    mesh.positions[1].x = up(mesh.positions[1].x, 3);
    mesh.positions[2].x = up(mesh.positions[2].x, 6);
    let chain = weld(&mesh);
    assert!(welded(&mesh, &chain).is_manifold(), "{chain:?}");
    assert!(!chain.ambiguous.is_empty() && chain.warning().is_some(), "{chain:?}");
}
