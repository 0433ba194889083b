//! The mesh that cut and fill produce, by index.

use std::collections::HashMap;

use super::exact::{GridEdge, Point};
use super::{Cut, Shape, Trouble};
use crate::geometry::DVec3;
use crate::mesh_repair::Source;
use crate::mesh_repair::fill::Fill;

/// A mesh that is being rebuilt; positions in cells.
pub struct Draft {
    /// Positions of the vertices (cells): those of the mesh first, then new ones.
    pub positions: Vec<DVec3>,
    /// Whether each vertex is new; the others are vertices of the mesh and never change.
    pub is_made: Vec<bool>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The source of each triangle.
    pub sources: Vec<Source>,
}

/// Joins the parts of a mesh whose own vertices have these positions (cells).
///
/// # Errors
/// [`Trouble`] without cells if a point has no position.
pub fn sewn(shape: &Shape, own: &[DVec3], cut: &Cut, fill: &Fill) -> Result<Draft, Trouble> {
    let mut draft = Draft {
        positions: own.to_vec(),
        is_made: vec![false; own.len()],
        triangles: cut.whole.iter().map(|triangle| shape.triangles[*triangle as usize]).collect(),
        sources: cut.whole.iter().map(|triangle| Source::Whole(*triangle)).collect(),
    };
    let mut numbers: HashMap<Point, u32> = HashMap::new();
    let mut number = |draft: &mut Draft, point: Point| -> Result<u32, Trouble> {
        if let Point::Vertex(vertex) = point {
            return Ok(vertex);
        }
        if let Some(number) = numbers.get(&point) {
            return Ok(*number);
        }
        let position = position(shape, fill, point).ok_or_else(|| Trouble(Vec::new()))?;
        let number = draft.positions.len() as u32;
        draft.positions.push(position);
        draft.is_made.push(true);
        numbers.insert(point, number);
        Ok(number)
    };
    let parts = cut.parts.iter().map(|(triangle, points)| (Source::Part(*triangle), points));
    let rebuilt = fill.triangles.iter().map(|points| (Source::New, points));
    for (source, points) in parts.chain(rebuilt) {
        let mut vertices = [0; 3];
        for (vertex, point) in vertices.iter_mut().zip(points) {
            *vertex = number(&mut draft, *point)?;
        }
        draft.triangles.push(vertices);
        draft.sources.push(source);
    }
    Ok(draft)
}

fn position(shape: &Shape, fill: &Fill, point: Point) -> Option<DVec3> {
    match point {
        Point::OnGrid(edge) => on_grid(fill, edge),
        Point::Middle(..) => {
            let at = fill.middles.binary_search_by(|(middle, _)| middle.cmp(&point)).ok()?;
            let ring = &fill.middles[at].1;
            let positions: Vec<DVec3> = ring
                .iter()
                .map(|point| match point {
                    Point::OnGrid(edge) => on_grid(fill, *edge),
                    other => shape.position(*other),
                })
                .collect::<Option<_>>()?;
            // Weighted by length: a cluster of many points pulls no more than a few points would.
            let next = positions.iter().cycle().skip(1);
            let (sum, all) = positions.iter().zip(next).fold((DVec3::zeros(), 0.0), |(sum, all), (a, b)| {
                let length = (b - a).norm();
                (sum + (a + b) * (0.5 * length), all + length)
            });
            Some(if all > 0.0 { sum / all } else { positions[0] })
        }
        other => shape.position(other),
    }
}

fn on_grid(fill: &Fill, edge: GridEdge) -> Option<DVec3> {
    let at = fill.shares.binary_search_by(|(other, _)| other.cmp(&edge)).ok()?;
    let mut position = DVec3::from(edge.1.map(f64::from));
    position[edge.0] += fill.shares[at].1;
    Some(position)
}
