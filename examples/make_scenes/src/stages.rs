//! The terrains of the spills in pictures: a bone in its bed, bars over a tray, a staircase, a hollow, and gauze that lies in it.

use std::f32::consts::TAU;
use std::path::Path;

use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;

use super::spills::{sheet, walls};

/// Writes their meshes.
pub fn write(folder: &Path) -> frazil::Result<()> {
    mesh::write(&folder.join("bone.obj"), &bone())?;
    mesh::write(&folder.join("grating.obj"), &grating())?;
    mesh::write(&folder.join("staircase.obj"), &staircase())?;
    mesh::write(&folder.join("wound.obj"), &wound())?;
    mesh::write(&folder.join("gauze.obj"), &gauze())
}

fn sine(phase: f32) -> f32 {
    libm::sinf(phase)
}

/// A smooth step from 0 at `low` to 1 at `high`.
fn between(low: f32, high: f32, number: f32) -> f32 {
    let part = ((number - low) / (high - low)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

/// A tube along x with closed ends and `along` x `around` points. `ring` gives its middle and radius at a share of its length, `bump` a factor of
/// the radius at that share and an angle.
fn tube(
    [along, around]: [u32; 2],
    ring: impl Fn(f32) -> (Vec3, f32),
    bump: impl Fn(f32, f32) -> f32,
) -> TriMesh {
    let mut mesh = TriMesh::default();
    for at in 0..along {
        let share = at as f32 / (along - 1) as f32;
        let (middle, radius) = ring(share);
        for step in 0..around {
            let angle = TAU * step as f32 / around as f32;
            let radius = radius * bump(share, angle);
            mesh.positions
                .push(middle + Vec3::new(0.0, radius * libm::cosf(angle), radius * libm::sinf(angle)));
        }
    }
    for at in 0..along - 1 {
        for step in 0..around {
            let next = (step + 1) % around;
            let [a, b] = [step, next].map(|step| at * around + step);
            let [c, d] = [a, b].map(|index| index + around);
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    for (at, is_last) in [(0, false), (along - 1, true)] {
        let centre = mesh.positions.len() as u32;
        mesh.positions.push(ring(at as f32 / (along - 1) as f32).0);
        for step in 0..around {
            let [a, b] = [step, (step + 1) % around].map(|step| at * around + step);
            mesh.triangles.push(if is_last { [centre, a, b] } else { [centre, b, a] });
        }
    }
    mesh
}

/// A knobbly bone, 10 cm of it, that lies free over a bed of tissue of 12 x 9 cm.
fn bone() -> TriMesh {
    let mut mesh = sheet([0.12, 0.09], [181, 136], |x, z| {
        let hollow = 0.016 * (between(0.012, 0.040, z.abs()) + 0.6 * between(0.035, 0.058, x.abs()));
        let folds =
            sine(95.0 * x + 40.0 * z) * sine(120.0 * z - 1.0) + 0.5 * sine(210.0 * x - 130.0 * z + 2.0);
        // The bed falls a little towards the position of the suction.
        hollow + 0.0006 * folds - 0.02 * x
    });
    let knob = |share: f32, at: f32, wide: f32| {
        let off = (share - at) / wide;
        libm::expf(-off * off)
    };
    let radius =
        move |share: f32| 0.0085 + 0.0065 * knob(share, 0.88, 0.12) + 0.0055 * knob(share, 0.1, 0.13);
    mesh.append(&tube(
        [260, 140],
        |share| {
            let ends = (share * (1.0 - share) * 4.0).min(1.0);
            let position = Vec3::new(
                0.102 * (share - 0.5),
                0.021 + 0.002 * sine(5.0 * share),
                0.003 * sine(4.0 * share),
            );
            (position, radius(share) * libm::powf(ends.max(1e-4), 0.35))
        },
        |share, angle| {
            let twist = angle + 2.0 * share;
            // Two condyles at the end, a ridge along the shaft, and small knobs.
            1.0 + 0.16 * knob(share, 0.9, 0.1) * libm::cosf(2.0 * angle)
                + 0.07 * libm::cosf(3.0 * twist) * (1.0 - knob(share, 0.9, 0.15))
                + 0.03 * sine(31.0 * share + 2.0 * sine(angle)) * sine(4.0 * angle + 2.0 * sine(17.0 * share))
                + 0.014 * sine(83.0 * share + 3.0 * sine(2.0 * angle + 1.0))
                + 0.010 * sine(7.0 * angle + 5.0 * sine(23.0 * share))
        },
    ));
    mesh
}

/// A tray of 12 x 9 cm, over it eleven round bars.
fn grating() -> TriMesh {
    let mut mesh = TriMesh::default();
    let (wide, deep) = (0.06, 0.045);
    mesh.append(&TriMesh::cuboid([-wide, 0.0, -deep], [wide, 0.003, deep]));
    let rim = 0.003;
    for [x0, x1, z0, z1] in walls([wide, deep], rim) {
        mesh.append(&TriMesh::cuboid([x0, 0.0, z0], [x1, 0.014, z1]));
    }
    // Two rails carry the bars.
    for z in [-0.036, 0.034] {
        mesh.append(&TriMesh::cuboid([-0.046, 0.032, z], [0.046, 0.0345, z + 0.002]));
    }
    for x in [-0.044, 0.042] {
        for z in [-0.036, 0.034] {
            mesh.append(&TriMesh::cuboid([x, 0.0, z], [x + 0.002, 0.033, z + 0.002]));
        }
    }
    for bar in -5..=5 {
        let x = 0.008 * bar as f32;
        let mut tube = tube(
            [2, 40],
            |share| (Vec3::new(0.08 * (share - 0.5), 0.036, 0.0), 0.0026),
            |_, angle| {
                // A flat top, like that of a worn bar.
                let up = libm::cosf(angle);
                if up > 0.8 { 0.8 / up } else { 1.0 }
            },
        );
        for position in &mut tube.positions {
            // Along z.
            *position = Vec3::new(x - position.z, position.y, position.x);
        }
        mesh.append(&tube);
    }
    mesh
}

/// Five steps of 18 mm, each 12 mm high, between low walls.
fn staircase() -> TriMesh {
    let mut mesh = TriMesh::default();
    let (deep, high, wide) = (0.018, 0.012, 0.03);
    for step in 0..5 {
        let x = -0.055 + deep * step as f32;
        let top = 0.003 + high * (4 - step) as f32;
        mesh.append(&TriMesh::cuboid([x, 0.0, -wide], [x + deep, top, wide]));
        for z in [-wide - 0.003, wide] {
            mesh.append(&TriMesh::cuboid([x, 0.0, z], [x + deep, top + 0.009, z + 0.003]));
        }
    }
    // The floor that it ends on, and a wall behind the highest step.
    mesh.append(&TriMesh::cuboid([0.03, 0.0, -0.042], [0.08, 0.002, 0.042]));
    mesh.append(&TriMesh::cuboid([-0.058, 0.0, -wide - 0.003], [-0.055, 0.062, wide + 0.003]));
    mesh
}

/// A hollow of 10 x 8 cm between soft folds.
fn wound() -> TriMesh {
    sheet([0.10, 0.08], [201, 161], |x, z| {
        let off = (x * x / (0.042 * 0.042) + z * z / (0.031 * 0.031)).sqrt();
        let folds = sine(130.0 * x + 50.0 * z) * sine(150.0 * z) + 0.6 * sine(260.0 * z - 90.0 * x + 1.0);
        0.011 * between(0.15, 1.25, off) + 0.0004 * folds
    })
}

/// A gauze pad of 26 x 20 mm, some 1.5 mm thick, with soft folds.
fn gauze() -> TriMesh {
    let (half, points) = ([0.013, 0.010], [105u32, 81]);
    let top = sheet([2.0 * half[0], 2.0 * half[1]], points, |x, z| {
        let fold =
            sine(420.0 * x + 260.0 * z + 2.0 * sine(300.0 * z)) + 0.6 * sine(350.0 * z - 180.0 * x + 1.0);
        let weave = sine(4200.0 * x) * sine(4200.0 * z);
        0.0010 + 0.0003 * fold + 0.0001 * weave
    });
    let count = top.positions.len() as u32;
    let mut mesh = top.clone();
    mesh.positions.extend(top.positions.iter().map(|at| Vec3::new(at.x, -0.0012, at.z)));
    mesh.triangles.extend(top.triangles.iter().map(|&[a, b, c]| [a + count, c + count, b + count]));
    // The sides: along the border of the top, which lies to the left.
    let [nx, nz] = points;
    let at = |x: u32, z: u32| z * nx + x;
    let mut border: Vec<u32> = (0..nz - 1).map(|z| at(0, z)).collect();
    border.extend((0..nx - 1).map(|x| at(x, nz - 1)));
    border.extend((1..nz).rev().map(|z| at(nx - 1, z)));
    border.extend((1..nx).rev().map(|x| at(x, 0)));
    for side in 0..border.len() {
        let [a, b] = [border[side], border[(side + 1) % border.len()]];
        mesh.triangles.extend([[a, a + count, b + count], [a, b + count, b]]);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_closed_has_a_volume() {
        let closed = |mesh: &TriMesh| {
            let mut edges: Vec<[u32; 2]> =
                mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
            edges.sort_unstable();
            edges.windows(2).all(|two| two[0] != two[1])
                && edges.iter().all(|&[a, b]| edges.binary_search(&[b, a]).is_ok())
        };
        for (mesh, least, most) in [
            (gauze(), 9e-7, 1.4e-6),
            (tube([2, 40], |share| (Vec3::new(share, 0.0, 0.0), 1.0), |_, _| 1.0), 3.0, 3.15),
        ] {
            assert!(closed(&mesh) && (least..most).contains(&mesh.volume()), "{}", mesh.volume());
        }
    }
}
