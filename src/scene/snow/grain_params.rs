//! Grain parameters from a scene's keys.

use super::keys::grains::material;
use crate::geometry::DVec3;
use crate::scene::Scene;
use crate::snow::grains::Params;

/// Parameters of the grains of a scene with cells of `cell` m.
pub(in crate::scene::snow) fn params(scene: &Scene, cell: f64) -> Params {
    let grains = scene.values.table("grains");
    let radius = grains.find("radius").unwrap_or(Params::for_cell(cell).radius);
    let [friction, attraction] = material(&scene.values, radius);
    let keep_box: Option<[f64; 6]> = grains.find("keep_box");
    Params {
        radius,
        compression: grains.get("compression"),
        friction,
        attraction,
        restitution: grains.get("restitution"),
        air: grains.get("air"),
        air_by_density: grains.get("air_by_density"),
        gravity: grains.get("gravity"),
        rests: grains.get("rest"),
        active_distance: grains.find("active_distance"),
        lifetime: grains.find("lifetime"),
        keep_box: keep_box.map(|[a, b, c, d, e, f]| [DVec3::new(a, b, c), DVec3::new(d, e, f)]),
        sub_steps: grains.find("substeps"),
        max_grains: grains.get("max"),
        seed: grains.get("seed"),
    }
}
