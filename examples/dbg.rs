//! Scratch.
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../benches/gates/scenes.rs"]
mod scenes;
use frazil::base::TriMesh;
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::level_set;
use scenes::context;
fn main() {
    let ctx = context(2);
    let bodies = scenes::walkers();
    let boot = &bodies[0];
    println!("lug-less? volume {}", common::boot::left_boot().volume());
    let mesh_at = |b: &Body, t: f64| {
        let mut p = Vec::new();
        b.motion().pose(t, &mut p).unwrap();
        TriMesh {
            positions: p.iter().map(|p| p.cast()).collect(),
            triangles: b.motion().triangles().to_vec(),
        }
    };
    let compare = |ours: &frazil::vdb::FloatGrid, truth: &frazil::vdb::FloatGrid, what: &str| {
        let (mut missed, mut fat, mut worst) = (0, 0, 0.0f32);
        for leaf in ours.leaves().unwrap() {
            for i in 0..512usize {
                let v = [
                    leaf.origin[0] + (i >> 6) as i32,
                    leaf.origin[1] + (i >> 3 & 7) as i32,
                    leaf.origin[2] + (i & 7) as i32,
                ];
                let t = truth.value(v) / 0.0075;
                let o = leaf.values[i] / 0.0075;
                if o > 0.0 && t < -0.5 {
                    missed += 1;
                    worst = worst.max(-t);
                }
                if o < 0.0 && t > 0.5 {
                    fat += 1;
                }
            }
        }
        println!("{what}: missed {missed} worst {worst} fat {fat}");
    };
    for tol in [0.02, 0.005] {
        for (from, to) in [(41.0, 41.0), (40.0, 41.0), (40.0, 40.25), (40.5, 40.75), (40.0, 40.03125)] {
            let s = sweep::chain(
                &ctx,
                std::slice::from_ref(boot),
                from,
                to,
                &Settings { tolerance: tol, ..Settings::new(0.0075) },
            )
            .unwrap();
            let n = if from == to { 1 } else { 129 };
            let mut u = None::<frazil::vdb::FloatGrid>;
            for k in 0..n {
                let t = if n == 1 { from } else { from + (to - from) * k as f64 / (n - 1) as f64 };
                let g = level_set::from_mesh(&ctx, &mesh_at(boot, t), 0.0075, 3.0).unwrap();
                match &mut u {
                    None => u = Some(g),
                    Some(u) => level_set::union(&ctx, u, g).unwrap(),
                }
            }
            compare(&s, &u.unwrap(), &format!("tol {tol} {from}-{to}"));
        }
    }
}
