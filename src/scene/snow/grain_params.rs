//! The parameters of grains that a scene asks for.

use super::keys::grains::material;
use crate::geometry::DVec3;
use crate::scene::Scene;
use crate::snow::grains::Params;

/// Parameters of the grains of a scene with cells of `cell` m.
pub(in crate::scene::snow) fn params(scene: &Scene, cell: f64) -> Params {
    let own = scene.values.table("grains");
    let radius = own.find("radius").unwrap_or(Params::for_cell(cell).radius);
    let [friction, attraction] = material(&scene.values, radius);
    let keep_box: Option<[f64; 6]> = own.find("keep_box");
    Params {
        radius,
        compression: own.get("compression"),
        friction,
        attraction,
        restitution: own.get("restitution"),
        air: own.get("air"),
        air_by_density: own.get("air_by_density"),
        gravity: own.get("gravity"),
        rests: own.get("rest"),
        active_distance: own.find("active_distance"),
        lifetime: own.find("lifetime"),
        keep_box: keep_box.map(|[a, b, c, d, e, f]| [DVec3::new(a, b, c), DVec3::new(d, e, f)]),
        sub_steps: own.find("substeps"),
        max_grains: own.get("max"),
        seed: own.get("seed"),
    }
}
