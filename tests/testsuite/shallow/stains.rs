//! What liquid leaves on the ground: stains that come, go and move with the mesh, and liquid that the ground absorbs.

use frazil::Context;
use frazil::geometry::{TriMesh, Vec3};
use frazil::shallow::columns::grid::{Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::stains::Absorbing;
use frazil::shallow::terrain::triangles;
use frazil::shallow::{Params, Scalar, Shallow, Staining, Stains};

use crate::common::bodies::Dice;
use crate::common::flowing::{FRAME, Frames, pour_each};
use crate::common::shallow::{context, source};

const CELL: f64 = 0.002;

/// A trough along x with walls at its ends, its vertices half a cell apart and not on the cells, moved by some cells along x.
fn trough(moved: f64) -> TriMesh {
    let [nx, nz] = [81_u32, 41];
    let position = |at: u32| {
        let [x, z] = [f64::from(at % nx), f64::from(at / nx)];
        let across = (z - 20.0) / 20.0;
        let bump = 0.002 * (0.3 * x).sin();
        let end = if (3.0..77.0).contains(&x) { 0.0 } else { 0.04 };
        Vec3::new(
            ((0.5 * x + 0.13 + moved) * CELL) as f32,
            (0.01 + 0.02 * across * across + bump * across + end) as f32,
            ((0.5 * z + 0.21) * CELL) as f32,
        )
    };
    let corner = |x: u32, z: u32| z * nx + x;
    let quads = (0..nz - 1).flat_map(|z| (0..nx - 1).map(move |x| [x, z]));
    let triangles = quads.flat_map(|[x, z]| {
        let [a, b, c, d] = [corner(x, z), corner(x + 1, z), corner(x + 1, z + 1), corner(x, z + 1)];
        [[a, c, b], [a, d, c]]
    });
    TriMesh { positions: (0..nx * nz).map(position).collect(), triangles: triangles.collect() }
}

fn solids(mesh: &TriMesh) -> frazil::shallow::terrain::Solids {
    let grid = Grid { cell: CELL, origin: [0.0; 2], size: [48, 21] };
    triangles::solids(&mesh.positions, &mesh.triangles, grid, Heights::between(0.0, 0.1).unwrap()).unwrap()
}

fn liquid(ctx: &Context, mesh: &TriMesh) -> Shallow {
    let params = Params { liquid: Liquid::new(1e-6), ..Params::default() };
    let mut liquid = Shallow::new(ctx, &solids(mesh), params).unwrap();
    liquid.set_scalars(&[Scalar::dye("blood")]).unwrap();
    liquid
}

/// Depth at the cell of a vertex (m); 0 outside.
fn depth_at(liquid: &Shallow, position: &Vec3) -> f64 {
    let at = [f64::from(position.x), f64::from(position.y), f64::from(position.z)];
    liquid.view().at(at).map_or(0.0, |reading| reading.depth)
}

fn stains_of(stains: &Stains) -> Vec<f32> {
    let mut out = vec![7.0; stains.len()];
    stains.stains(&mut out).unwrap();
    out
}

#[test]
fn a_stain_comes_while_it_is_wet_and_halves_when_it_is_dry() {
    let (ctx, mesh) = (context(), trough(0.0));
    let mut liquid = liquid(&ctx, &mesh);
    let staining = Staining { scalar: Some(0), half_life: 2.0, takes: 0.5, ..Staining::default() };
    let mut stains = Stains::new(&liquid, &mesh.positions, &mesh.triangles, staining).unwrap();
    liquid.set_poured(&[0.8]).unwrap();
    liquid.fill(0.02);
    let wet: Vec<bool> = mesh.positions.iter().map(|position| depth_at(&liquid, position) > 1e-5).collect();
    assert!((200..3000).contains(&wet.iter().filter(|wet| **wet).count()));
    for _ in 0..60 {
        liquid.step(&ctx, FRAME).unwrap();
        assert_eq!(stains.update(&mut liquid, &mesh.positions).unwrap(), 0.0);
    }
    let wanted = 0.8 * (1.0 - (-1.0_f64 / 0.5).exp());
    for (vertex, stain) in stains_of(&stains).into_iter().enumerate() {
        let wanted = if wet[vertex] { wanted } else { 0.0 };
        assert!((f64::from(stain) - wanted).abs() < 1e-4, "vertex {vertex}: {stain}, {wanted}");
    }
    // Clear liquid washes it off.
    let stained = stains_of(&stains);
    let mut washed = (stains.clone(), Shallow::new(&ctx, &solids(&mesh), liquid.params().clone()).unwrap());
    washed.1.set_scalars(&[Scalar::dye("water")]).unwrap();
    washed.1.fill(0.02);
    washed.1.frames(&ctx, FRAME, 60);
    for _ in 0..30 {
        washed.1.step(&ctx, FRAME).unwrap();
        washed.0.update(&mut washed.1, &mesh.positions).unwrap();
    }
    for (after, before) in stains_of(&washed.0).into_iter().zip(&stained) {
        let wanted = f64::from(*before) * (-0.5_f64 / 0.5).exp();
        assert!((f64::from(after) - wanted).abs() < 1e-4, "{after} of {before}");
    }
    // Without liquid it fades, seen every frame or not.
    pour_each(&mut liquid, |_| -1.0);
    let mut unseen = stains.clone();
    for _ in 0..240 {
        liquid.step(&ctx, FRAME).unwrap();
        stains.update(&mut liquid, &mesh.positions).unwrap();
    }
    unseen.update(&mut liquid, &mesh.positions).unwrap();
    assert_eq!(stains_of(&stains), stains_of(&unseen));
    for (after, before) in stains_of(&stains).into_iter().zip(&stained) {
        assert!((after - before / 4.0).abs() < 1e-4, "{after} of {before}");
    }
}

#[test]
fn stains_move_with_the_mesh() {
    let (ctx, mut mesh) = (context(), trough(0.0));
    let mut liquid = liquid(&ctx, &mesh);
    let stay = Staining { half_life: f64::INFINITY, ..Staining::default() };
    let mut stains = Stains::new(&liquid, &mesh.positions, &mesh.triangles, stay).unwrap();
    let middle = [0.03, 0.012, 0.021];
    liquid.set_flows(&[source(middle, 0.004, 1e-6)], |_| "the source".into()).unwrap();
    for _ in 0..30 {
        liquid.step(&ctx, FRAME).unwrap();
        stains.update(&mut liquid, &mesh.positions).unwrap();
    }
    liquid.set_flows(&[], |_| String::new()).unwrap();
    pour_each(&mut liquid, |_| -1.0);
    let before = stains_of(&stains);
    assert!(before.iter().filter(|stain| **stain > 0.9).count() > 50);
    for frame in 1..=40 {
        mesh = trough(0.2 * f64::from(frame));
        liquid.update_terrain(&solids(&mesh)).unwrap();
        liquid.step(&ctx, FRAME).unwrap();
        stains.update(&mut liquid, &mesh.positions).unwrap();
    }
    assert_eq!(stains_of(&stains), before);
}

#[test]
fn ground_absorbs_what_it_holds_and_the_balance_says_so() {
    let (ctx, mesh) = (context(), trough(0.0));
    let mut liquid = liquid(&ctx, &mesh);
    let absorbing = Absorbing { capacity: 1e-4, rate: 2e-4 };
    let staining = Staining { absorbs: Some(absorbing), ..Staining::default() };
    let mut stains = Stains::new(&liquid, &mesh.positions, &mesh.triangles, staining).unwrap();
    liquid.set_poured(&[0.5]).unwrap();
    liquid.fill(0.02);
    let poured = liquid.balance().poured;
    let mut sum = 0.0;
    for frame in 0..300 {
        liquid.step(&ctx, FRAME).unwrap();
        sum += stains.update(&mut liquid, &mesh.positions).unwrap();
        let balance = liquid.balance();
        assert_eq!(balance.error, 0, "frame {frame}");
        assert_eq!(liquid.scalar_balance(0).unwrap().error, 0);
        assert!((balance.absorbed - stains.absorbed()).abs() < 1e-18);
    }
    assert!((sum / stains.absorbed() - 1.0).abs() < 1e-9);
    let mut soaked = vec![7.0; stains.len()];
    stains.soaked(&mut soaked).unwrap();
    // 1 - exp(-t rate / capacity) of what has been wet, by steps of a frame: dry above the pool.
    let wanted = 1.0 - (1.0_f64 - FRAME * 2.0).powi(300);
    let deep: Vec<usize> =
        (0..stains.len()).filter(|&vertex| depth_at(&liquid, &mesh.positions[vertex]) > 2e-3).collect();
    assert!(deep.len() > 100);
    for vertex in deep {
        assert!((f64::from(soaked[vertex]) - wanted).abs() < 1e-3, "vertex {vertex}: {}", soaked[vertex]);
    }
    assert!(soaked.iter().filter(|soaked| **soaked == 0.0).count() > 200);
    assert!(poured > stains.absorbed() && stains.absorbed() > 1e-8, "{poured} {}", stains.absorbed());
    // A puddle that is less than the ground holds is gone.
    let mut puddle = Shallow::new(&ctx, &solids(&mesh), liquid.params().clone()).unwrap();
    let mut dry = Stains::new(&puddle, &mesh.positions, &mesh.triangles, staining).unwrap();
    puddle.set_flows(&[source([0.03, 0.012, 0.021], 0.006, 1e-7)], |_| "the source".into()).unwrap();
    puddle.frames(&ctx, FRAME, 6);
    puddle.set_flows(&[], |_| String::new()).unwrap();
    for _ in 0..600 {
        puddle.step(&ctx, FRAME).unwrap();
        dry.update(&mut puddle, &mesh.positions).unwrap();
    }
    let balance = puddle.balance();
    // What is thinner than a film is not absorbed.
    assert!(balance.error == 0 && balance.inside < 0.2 * balance.sourced, "{balance:?}");
}

#[test]
fn saved_stains_go_on_to_the_same_bytes_and_others_are_refused() {
    let (ctx, mesh) = (context(), trough(0.0));
    let absorbs = Some(Absorbing { capacity: 1e-4, rate: 1e-5 });
    let staining = Staining { scalar: Some(0), absorbs, ..Staining::default() };
    let begin = || {
        let mut liquid = liquid(&ctx, &mesh);
        let middle = [0.03, 0.012, 0.021];
        liquid.set_flows(&[source(middle, 0.004, 2e-6)], |_| "the source".into()).unwrap();
        liquid.set_sourced(0, &[0.7]).unwrap();
        let stains = Stains::new(&liquid, &mesh.positions, &mesh.triangles, staining).unwrap();
        (liquid, stains)
    };
    let run = |(liquid, stains): &mut (Shallow, Stains), frames: usize| {
        for _ in 0..frames {
            liquid.step(&ctx, FRAME).unwrap();
            stains.update(liquid, &mesh.positions).unwrap();
        }
    };
    let mut all = begin();
    run(&mut all, 20);
    let saved = (all.0.save(), all.1.save());
    run(&mut all, 20);
    let mut resumed = begin();
    resumed.0.restore(&saved.0).unwrap();
    resumed.1.restore(&saved.1).unwrap();
    assert_eq!(resumed.1.save(), saved.1);
    run(&mut resumed, 20);
    assert!(resumed.0.save() == all.0.save() && resumed.1.save() == all.1.save());

    let other = TriMesh { triangles: mesh.triangles[1..].to_vec(), ..trough(0.0) };
    let mut of_other = Stains::new(&all.0, &other.positions, &other.triangles, staining).unwrap();
    let before = of_other.save();
    let error = of_other.restore(&saved.1).unwrap_err().to_string();
    assert!(error.contains("of another terrain"), "{error}");
    let plain = Staining { absorbs: None, ..staining };
    let mut other = Stains::new(&all.0, &mesh.positions, &mesh.triangles, plain).unwrap();
    assert!(other.restore(&saved.1).unwrap_err().to_string().contains("absorbs in another way"));
    let mut dice = Dice(18);
    for _ in 0..10_000 {
        let mut bad = saved.1.clone();
        match dice.below(2) {
            0 => bad.truncate(dice.below(bad.len())),
            _ => {
                let at = dice.below(bad.len());
                bad[at] ^= 1 << dice.below(8);
            }
        }
        let kept = all.1.save();
        let error = all.1.restore(&bad).unwrap_err().to_string();
        assert!(error.contains("saved stains are"), "{error}");
        assert!(all.1.save() == kept);
    }
    assert!(of_other.save() == before);
}

#[test]
fn wrong_numbers_are_a_sentence() {
    let (ctx, mesh) = (context(), trough(0.0));
    let mut liquid = liquid(&ctx, &mesh);
    let new = |liquid: &Shallow, staining| Stains::new(liquid, &mesh.positions, &mesh.triangles, staining);
    let plain = Staining::default();
    for (staining, what) in [
        (Staining { film: f64::NAN, ..plain }, "film = NaN is negative or not finite"),
        (Staining { takes: -1.0, ..plain }, "takes = -1 is negative"),
        (Staining { half_life: 0.0, ..plain }, "half_life = 0 s is not 0.001 or more"),
        (Staining { half_life: f64::NAN, ..plain }, "half_life = NaN s"),
        (Staining { scalar: Some(1), ..plain }, "no scalar 1 among 1"),
        (
            Staining { absorbs: Some(Absorbing { capacity: 0.0, rate: 1.0 }), ..plain },
            "absorbs.capacity = 0 m",
        ),
        (
            Staining { absorbs: Some(Absorbing { capacity: 1.0, rate: f64::INFINITY }), ..plain },
            "absorbs.rate = inf",
        ),
    ] {
        let error = new(&liquid, staining).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
    let error = Stains::new(&liquid, &mesh.positions[..9], &mesh.triangles, plain).unwrap_err().to_string();
    assert!(error.contains("no vertex"), "{error}");
    let mut bad = mesh.positions.clone();
    bad[5].y = f32::NAN;
    let mut stains = new(&liquid, plain).unwrap();
    let error = stains.update(&mut liquid, &bad).unwrap_err().to_string();
    assert_eq!(error, "vertex 5 of the terrain is not finite");
    let error = stains.update(&mut liquid, &bad[..4]).unwrap_err().to_string();
    assert!(error.contains("4 vertices are not the 3321 of the terrain"), "{error}");
    assert!(stains.stains(&mut [0.0; 3]).unwrap_err().to_string().contains("room for 3 stains"));
    let coarse = Grid { cell: 0.004, origin: [0.0; 2], size: [24, 11] };
    let coarse =
        triangles::solids(&mesh.positions, &mesh.triangles, coarse, Heights::between(0.0, 0.1).unwrap());
    let mut other = Shallow::new(&ctx, &coarse.unwrap(), liquid.params().clone()).unwrap();
    let error = stains.update(&mut other, &mesh.positions).unwrap_err().to_string();
    assert!(error.contains("other cells or heights"), "{error}");
    // A scalar that is gone.
    let mut of_dye = new(&liquid, Staining { scalar: Some(0), ..plain }).unwrap();
    liquid.set_scalars(&[]).unwrap();
    let error = of_dye.update(&mut liquid, &mesh.positions).unwrap_err().to_string();
    assert!(error.contains("no scalar 0 among 0"), "{error}");
}
