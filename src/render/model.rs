//! A surface to be drawn: triangles in a tree, with normals and colours.

use super::ramp::ramp;
use super::shade::Colour;
use crate::geometry::spatial::bvh::Bvh;
use crate::geometry::{DVec3, TriMesh, Vec3};

/// A mesh or a level set, ready to be drawn.
pub struct Model {
    mesh: TriMesh,
    tree: Bvh,
    /// Unit normals at the vertices of a smooth surface; without them triangles are flat.
    pub(super) normals: Option<Vec<Vec3>>,
    albedo: Colour,
    /// Colours of the vertices, instead of a single one.
    colours: Option<Vec<[f32; 3]>>,
    /// Opacities of the vertices of a liquid, 0 to 1.
    pub(super) opacities: Option<Vec<f32>>,
    /// Rays towards the light start this far off the surface (m), so that it casts no shadow on itself.
    pub(super) shadow_bias: f64,
}

/// The intersection of a ray with a model.
pub(super) struct Hit {
    /// Distance along the ray (m).
    pub distance: f64,
    /// Unit normal, towards the ray's origin.
    pub normal: DVec3,
    /// Share of the light that the surface reflects, for each channel.
    pub albedo: Colour,
    /// As [`Model::shadow_bias`].
    pub shadow_bias: f64,
    /// Wrap lighting: how far light reaches the side that faces away from the sun, from 0 (not at all) to 1 (all of it).
    pub wrap: f64,
    /// Opacity of a liquid, 0 to 1; none if it is not a liquid.
    pub opacity: Option<f64>,
}

impl Model {
    /// A mesh with flat triangles and a colour (linear red, green, blue, 0 to 1).
    pub fn mesh(mesh: &TriMesh, albedo: [f32; 3]) -> Self {
        let extent = bounds_of(mesh).map_or(1.0, |(low, high)| (high - low).norm());
        Self::new(mesh.clone(), None, albedo, 1.0e-5 * extent)
    }

    pub(super) fn new(mesh: TriMesh, normals: Option<Vec<Vec3>>, albedo: [f32; 3], shadow_bias: f64) -> Self {
        let tree = Bvh::new(&mesh);
        let albedo = Colour::from(albedo.map(f64::from));
        Self { mesh, tree, normals, albedo, colours: None, opacities: None, shadow_bias }
    }

    /// Colours the vertices by numbers, from dark blue at the minimum to pale yellow at the maximum; numbers that are not finite count as
    /// the minimum.
    pub fn coloured(self, numbers: &[f64]) -> Self {
        let finite = numbers.iter().filter(|number| number.is_finite());
        let (low, high) =
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), n| (low.min(*n), high.max(*n)));
        let colours = numbers.iter().map(|number| ramp((number - low) / (high - low)));
        Self { colours: Some(colours.collect()), ..self }
    }

    /// Gives each vertex a colour (linear red, green, blue, 0 to 1).
    pub fn painted(self, colours: Vec<[f32; 3]>) -> Self {
        Self { colours: Some(colours), ..self }
    }

    /// Its minimum and maximum corner (m); none if it is empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        bounds_of(&self.mesh)
    }

    /// The first point of the surface on a ray with a unit direction.
    pub(super) fn hit(&self, origin: DVec3, toward: DVec3) -> Option<Hit> {
        let hit = self.tree.ray(origin, toward, f64::INFINITY)?;
        let corners = self.mesh.triangles[hit.triangle].map(|index| index as usize);
        let [a, b, c] = corners.map(|index| self.mesh.positions[index].cast::<f64>());
        let flat = (b - a).cross(&(c - a));
        let smooth = self.normals.as_ref().map_or(flat, |normals| {
            let [a, b, c] = corners.map(|index| normals[index].cast::<f64>());
            a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
        });
        // A triangle seen from behind is flipped; a smooth normal always stays on the visible side.
        let normal = if flat.dot(&toward) > 0.0 { -smooth } else { smooth };
        let facing_away = normal.dot(&toward).max(0.0);
        let normal = (normal - toward * facing_away).try_normalize(0.0).unwrap_or(-toward);
        let albedo = self.colours.as_ref().map_or(self.albedo, |colours| {
            let [a, b, c] = corners.map(|index| Colour::from(colours[index].map(f64::from)));
            a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
        });
        let opacity = self.opacities.as_ref().map(|opacities| {
            let [a, b, c] = corners.map(|index| f64::from(opacities[index]));
            (a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v).clamp(0.0, 1.0)
        });
        Some(Hit {
            distance: hit.distance,
            normal,
            albedo,
            shadow_bias: self.shadow_bias,
            wrap: 0.0,
            opacity,
        })
    }

    /// Whether the surface blocks a direction from a point; a liquid's does not.
    pub(super) fn blocks(&self, origin: DVec3, toward: DVec3) -> bool {
        self.opacities.is_none() && self.tree.any_hit(origin, toward, f64::INFINITY)
    }
}

/// The mean of the triangles' normals around each vertex, weighted by area.
pub(super) fn smooth_normals(mesh: &TriMesh) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        let area = (b - a).cross(&(c - a));
        for index in triangle {
            normals[*index as usize] += area;
        }
    }
    normals.iter().map(|normal| normal.try_normalize(0.0).unwrap_or_else(Vec3::y)).collect()
}

fn bounds_of(mesh: &TriMesh) -> Option<(DVec3, DVec3)> {
    mesh.bounds().map(|(low, high)| (low.cast(), high.cast()))
}
