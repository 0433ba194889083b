//! The parameters of grains that a scene asks for.

use super::keys::grains::material;
use crate::geometry::DVec3;
use crate::scene::Scene;
use crate::snow::grains::Params;

/// Parameters of the grains of a scene with cells of `cell` m.
pub(in crate::scene::snow) fn params(scene: &Scene, cell: f64) -> Params {
    let values = &scene.values;
    let number = |name: &str| values.number(&format!("grains.{name}"));
    let whole = |name: &str| values.get(&format!("grains.{name}")).and_then(|value| value.whole());
    let defaults = Params::for_cell(cell);
    let radius = number("radius").unwrap_or(defaults.radius);
    let [friction, attraction] = material(values, radius);
    let keep_box = values.get("grains.keep_box").and_then(|value| value.numbers());
    Params {
        radius,
        compression: values.settled("grains", None, "compression"),
        friction,
        attraction,
        restitution: values.settled("grains", None, "restitution"),
        air: values.settled("grains", None, "air"),
        air_by_density: values.settled("grains", None, "air_by_density"),
        gravity: values.settled("grains", None, "gravity"),
        rests: values.settled("grains", None, "rest"),
        active_distance: number("active_distance"),
        lifetime: number("lifetime"),
        keep_box: keep_box.map(|[a, b, c, d, e, f]| [DVec3::new(a, b, c), DVec3::new(d, e, f)]),
        sub_steps: whole("substeps").map(|count| count as u32),
        most: values.settled::<i64>("grains", None, "max") as usize,
        seed: values.settled::<i64>("grains", None, "seed") as u64,
    }
}
