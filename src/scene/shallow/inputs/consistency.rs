//! Conditions that keys of `[shallow]` must meet together; errors name file and line.

use super::scalars;
use crate::error::Result;
use crate::io::files::sequence::Pattern;
use crate::io::mesh::{EXTENSIONS, extension};
use crate::scene::Frames;
use crate::scene::schema::declaration::OBJECT;
use crate::scene::schema::{Table, Value, Values};
use crate::scene::shallow::{Obstacle, ObstacleShape, Shallow};

impl Shallow {
    /// Checks the keys of `[shallow]` in combination.
    ///
    /// # Errors
    /// Keys that exclude each other, or one that others need.
    pub(in crate::scene) fn check(table: &Table, values: &Values) -> Result<()> {
        let Some(shallow) = Self::of(values) else { return Ok(()) };
        check_image(&shallow, table, values)?;
        let is_mesh = EXTENSIONS.contains(&&*extension(&shallow.terrain));
        if !is_mesh && shallow.space != crate::motion::Space::OWN {
            let name = ["scale", "up"].into_iter().find(|name| table.has(name)).unwrap_or("origin");
            return Err(table.error(name, "is for meshes: leave it out"));
        }
        if !is_mesh && shallow.sequence().is_some() {
            return Err(table.error("terrain", "may be a sequence of meshes, not of other files"));
        }
        if !is_mesh && shallow.staining.is_some() {
            return Err(table.error("stains", "must be false: only a terrain that is a mesh can have stains"));
        }
        if shallow.area.is_some_and(|[x0, z0, x1, z1]| x1 <= x0 || z1 <= z0) {
            return Err(table.error("area", "must be [x0, z0, x1, z1] with x0 < x1 and z0 < z1"));
        }
        if let (Some(bottom), Some(top)) = (shallow.bottom, shallow.top)
            && bottom >= top
        {
            return Err(table.error("top", format!("must be above `bottom`, {bottom} m")));
        }
        if let (Some(fill), Some(top)) = (shallow.fill, shallow.top)
            && fill > top
        {
            return Err(table.error("fill", format!("must not be above `top`, {top} m")));
        }
        if shallow.params.liquid.thinning.is_some() && shallow.look != "blood" {
            return Err(table.error("thinning", "is for blood only: leave it out"));
        }
        // The ranges of the keys imply all other conditions.
        shallow.params.validate().map_err(|_| {
            table.error("gravity", "must point down by 0.001 to 1000 m/s2, and lean by 45 degrees at most")
        })
    }

    /// Checks the keys of an element of an array of tables in combination.
    ///
    /// # Errors
    /// As [`Shallow::check`].
    pub(in crate::scene) fn check_each(
        name: &str,
        index: usize,
        table: &Table,
        values: &Values,
    ) -> Result<()> {
        let own = values.element(name, index);
        match name {
            "object" => check_object(index, table, values),
            "scalar" => scalars::check(index, table, values),
            "pour" => {
                scalars::check_concentrations(name, index, table, values)?;
                let first = values.table("shot").get::<Frames>("frames").first;
                if own.find::<i32>("frame").is_some_and(|frame| frame < first) {
                    let what = format!("must not lie before the shot's first frame, {first}");
                    return Err(table.error("frame", what));
                }
                Ok(())
            }
            _ => {
                scalars::check_concentrations(name, index, table, values)?;
                let terrain = values.get("shallow.terrain").and_then(Value::path);
                if own.get("follows") && terrain.and_then(Pattern::parse).is_none() {
                    let what = "must be false where the terrain does not move: it needs a sequence of meshes, such as \"organ.%04d.ply\"";
                    return Err(table.error("follows", what));
                }
                match (own.find::<i32>("from"), own.find::<i32>("until")) {
                    (Some(from), Some(until)) if from > until => {
                        Err(table.error("until", format!("must not lie before `from`, {from}")))
                    }
                    _ => Ok(()),
                }
            }
        }
    }
}

/// Checks the placement of an image of heights.
fn check_image(shallow: &Shallow, table: &Table, values: &Values) -> Result<()> {
    let is_image = extension(&shallow.terrain) == "png";
    for name in ["terrain_size", "terrain_height"] {
        match (is_image, values.table("shallow").value(name).is_some()) {
            (true, false) => {
                return Err(table.error(name, "is missing: an image needs its size and its heights (m)"));
            }
            (false, true) => return Err(table.error(name, "is for a .png image: leave it out")),
            _ => {}
        }
    }
    let Some(image) = shallow.image else { return Ok(()) };
    if image.size.iter().any(|length| *length <= 0.0) {
        return Err(table.error("terrain_size", "must be two lengths over 0 m"));
    }
    if image.heights[0] >= image.heights[1] {
        return Err(table.error("terrain_height", "must be [low, high] with low < high"));
    }
    Ok(())
}

fn check_object(index: usize, table: &Table, values: &Values) -> Result<()> {
    let own = values.element(OBJECT, index);
    let named = own.text("shape");
    match (named, own.value("file")) {
        (None, None) => return Err(table.error("shape", "is missing (or `file`, a mesh)")),
        (Some(_), Some(_)) => return Err(table.error("file", "excludes `shape`: give one of them")),
        _ => {}
    }
    let needed: &[&str] = match named {
        Some("sphere") => &["radius"],
        Some("capsule") => &["radius", "length"],
        Some(_) => &["size"],
        None => &[],
    };
    for name in ["radius", "length", "size"] {
        match (needed.contains(&name), own.value(name)) {
            (true, None) => {
                return Err(table.error(name, format!("is missing: a {} needs one", named.unwrap_or(""))));
            }
            (false, Some(_)) => {
                let shape = named.unwrap_or("mesh");
                return Err(table.error(name, format!("is not for a {shape}: leave it out")));
            }
            _ => {}
        }
    }
    let Some(obstacle) = Obstacle::of(values, index) else { return Ok(()) };
    match &obstacle.shape {
        ObstacleShape::Sphere(radius) | ObstacleShape::Capsule(radius, _) if *radius <= 0.0 => {
            Err(table.error("radius", "must be over 0 m"))
        }
        ObstacleShape::Cuboid(size) if size.iter().any(|length| *length <= 0.0) => {
            Err(table.error("size", "must be three lengths over 0 m"))
        }
        ObstacleShape::Mesh(..) if obstacle.keys.len() > 1 => {
            Err(table.error("keys", "of a file may be at most one: a mesh does not move (a shape does)"))
        }
        ObstacleShape::Mesh(path, _) if Pattern::parse(path).is_some() => Err(table
            .error("file", "must be one file: a mesh does not move (a shape does, and so does the terrain)")),
        _ => Ok(()),
    }
}
