//! scratch
use frazil::base::{DVec3, TriMesh, Vec3};
use frazil::motion::Motion;
use frazil::snow::base_layer::{BaseLayer, NoiseParams, Params, initial};
use frazil::sweep::Body;
use frazil::{Context, Pool, Result};
struct Ball {
    mesh: TriMesh,
    speed: DVec3,
    spin: f64,
    at: DVec3,
}
impl Motion for Ball {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }
    fn vertex_count(&self) -> usize {
        self.mesh.positions.len()
    }
    fn pose(&self, t: f64, out: &mut Vec<DVec3>) -> Result<()> {
        out.clear();
        let r = nalgebra::Rotation3::from_axis_angle(
            &nalgebra::Unit::new_normalize(DVec3::new(1.0, 1.0, 1.0)),
            self.spin * t,
        );
        out.extend(self.mesh.positions.iter().map(|p| r * p.cast::<f64>() + self.at + self.speed * t));
        Ok(())
    }
    fn breaks(&self, _: f64, _: f64) -> Vec<f64> {
        vec![]
    }
}
fn sphere(n: usize, r: f32) -> TriMesh {
    // cube-sphere
    let mut m = TriMesh::default();
    for f in 0..6 {
        let base = m.positions.len() as u32;
        for i in 0..=n {
            for j in 0..=n {
                let (u, v) = (2.0 * i as f32 / n as f32 - 1.0, 2.0 * j as f32 / n as f32 - 1.0);
                let p = match f {
                    0 => [1.0, u, v],
                    1 => [-1.0, v, u],
                    2 => [v, 1.0, u],
                    3 => [u, -1.0, v],
                    4 => [u, v, 1.0],
                    _ => [v, u, -1.0],
                };
                m.positions.push(Vec3::from(p).normalize() * r);
            }
        }
        let id = |i: usize, j: usize| base + (i * (n + 1) + j) as u32;
        for i in 0..n {
            for j in 0..n {
                m.triangles.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
                m.triangles.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
            }
        }
    }
    m
}
fn main() {
    let args: Vec<f64> = std::env::args().skip(1).map(|a| a.parse().unwrap()).collect();
    let (threads, size, cell) = (args[0] as usize, args[1], args[2]);
    let ctx = Context::new(Pool::new(threads).unwrap());
    let ground =
        initial::Ground::Plane { height: 0.0, area: [-size / 2.0, -size / 2.0, size / 2.0, size / 2.0] };
    let t = std::time::Instant::now();
    let layer = initial::layer(&ctx, &ground, &[], &initial::Cover::Depth(0.3), cell, 3.0).unwrap();
    println!(
        "initial {:?} active {} leaves {} bytes {} per {:.2}",
        t.elapsed(),
        layer.active_voxels(),
        layer.leaf_count(),
        layer.memory_bytes(),
        layer.memory_bytes() as f64 / layer.active_voxels() as f64
    );
    let m = frazil::vdb::level_set::measure(&ctx, &layer).unwrap();
    println!("{m:?} expected {}", size * size * 0.3);
    let mut base = BaseLayer::new(
        &ctx,
        layer,
        Params {
            noise: if args[3] > 0.0 { Some(NoiseParams::for_cell(cell)) } else { None },
            tolerance: 0.02,
        },
    )
    .unwrap();
    let ball = Ball {
        mesh: sphere(64, 0.2),
        speed: DVec3::new(0.1, 0.0, 0.0),
        spin: 0.3,
        at: DVec3::new(-0.6, 0.3, 0.0),
    };
    let body = Body::new(Box::new(ball), 0.0).unwrap();
    let r = base.step(&ctx, std::slice::from_ref(&body), 0.0, 0.0, 0).unwrap();
    println!(
        "first: removed {:.6} expected half ball {:.6}",
        r.removed_volume,
        2.0 / 3.0 * 3.14159265 * 0.008
    );
    let v0 = base.volume();
    for f in 1..=8 {
        let t = std::time::Instant::now();
        let r = base.step(&ctx, std::slice::from_ref(&body), f as f64 - 1.0, f as f64, f).unwrap();
        let e = t.elapsed();
        let rm = frazil::vdb::level_set::measure(&ctx, base.removed()).unwrap();
        println!(
            "frame {f}: {e:?} removed {:.7} measured {:.7} exp {:.7} blocks {} faces {} {:?}",
            r.removed_volume,
            rm.volume,
            0.1 * 3.14159265 * 0.04 / 2.0,
            r.touched_blocks,
            r.sweep_faces,
            r.stages
                .iter()
                .map(|s| format!("{} {:.1}", s.name, s.time.as_secs_f64() * 1e3))
                .collect::<Vec<_>>()
        );
    }
    println!("total removed {:.6}", v0 - base.volume());
    println!("islands {:?}", frazil::vdb::level_set::components(&ctx, base.surface()).unwrap());
    let _ = frazil::vdb::file::write(
        std::path::Path::new("/tmp/probe.vdb"),
        &[base.surface(), base.compression(), base.touched()],
        &Default::default(),
    );
}
