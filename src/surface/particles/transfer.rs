//! Particle attributes at the vertices of a surface: weighted means over the particles around each.

use rayon::prelude::*;

use super::grid::Cells;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;

/// Radius within which particles count (spacings); it is doubled where there are none.
const RADIUS: f64 = 2.0;
/// Maximum number of doublings.
const DOUBLINGS: u32 = 4;
/// Vertices of a task.
const PIECE: usize = 256;

/// Weighted means, at vertices (m), of the values of particles at positions (m) whose spacing is `spacing` (m): a particle at a distance d
/// has the weight (1 - (d / R)^2)^3. Each column has one value for each particle; each result has one for each vertex, 0 where no particle
/// is near.
///
/// # Errors
/// Particles too far apart; cancel.
pub fn transfer(
    ctx: &Context,
    positions: &[DVec3],
    spacing: f64,
    vertices: &[DVec3],
    columns: &[Vec<f32>],
) -> Result<Vec<Vec<f32>>> {
    let edge = RADIUS * spacing;
    let cells = Cells::new(positions, edge, i64::from)?;
    let means = |vertex: &DVec3, sums: &mut [f64]| {
        let cell = [0, 1, 2].map(|axis| (vertex[axis] / edge).floor() as i32);
        let at = vertex / edge - DVec3::from(cell.map(f64::from));
        for doubling in 0..=DOUBLINGS {
            let reach = 1 << doubling;
            let (mut all, square) = (0.0, f64::from(reach).powi(2));
            sums.fill(0.0);
            cells.near(cell.map(|x| x - reach), cell.map(|x| x + reach), cell, |particle, offset| {
                let d = DVec3::from(offset.map(f64::from)) - at;
                let q = 1.0 - d.norm_squared() / square;
                if q > 0.0 {
                    let weight = q * q * q;
                    all += weight;
                    let particle = cells.order[particle] as usize;
                    for (sum, column) in sums.iter_mut().zip(columns) {
                        *sum += weight * f64::from(column[particle]);
                    }
                }
            });
            if all > 0.0 {
                return sums.iter_mut().for_each(|sum| *sum /= all);
            }
        }
    };
    let rows: Vec<Vec<f64>> = vertices
        .par_chunks(PIECE)
        .map(|piece| {
            ctx.check()?;
            let mut out = vec![0.0; piece.len() * columns.len()];
            if !columns.is_empty() {
                piece
                    .iter()
                    .zip(out.chunks_mut(columns.len()))
                    .for_each(|(vertex, sums)| means(vertex, sums));
            }
            Ok(out)
        })
        .collect::<Result<_>>()?;
    let column =
        |n: usize| rows.iter().flat_map(|row| row.chunks(columns.len())).map(|sums| sums[n] as f32).collect();
    Ok((0..columns.len()).map(column).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::context;

    #[test]
    fn a_linear_field_is_met_in_the_middle_and_far_vertices_have_the_nearest() {
        let ctx = context(2);
        let positions: Vec<DVec3> = (0..1000)
            .map(|n| DVec3::new(f64::from(n % 10), f64::from(n / 10 % 10), f64::from(n / 100)) * 0.1)
            .collect();
        let columns = [positions.iter().map(|p| 2.0 * p.x as f32 + 1.0).collect(), vec![7.0; 1000]];
        let vertices = [DVec3::repeat(0.45), DVec3::new(-0.3, 0.45, 0.45), DVec3::repeat(90.0)];
        let means = transfer(&ctx, &positions, 0.1, &vertices, &columns).unwrap();
        assert!((means[0][0] - 1.9).abs() < 1e-5 && means[0][1] < 1.3, "{means:?}");
        assert_eq!(means[1], [7.0, 7.0, 0.0]);
        assert!(transfer(&ctx, &positions, 0.1, &vertices, &[]).unwrap().is_empty());
    }
}
