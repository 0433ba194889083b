//! Reads the objects of a scene file.

use super::file::{FAR, name};
use super::keys::names;
use super::table::Table;
use crate::error::Result;
use crate::io::mesh::{EXTENSIONS, extension};
use crate::motion::{Space, Up, is_gltf};
use crate::scene::{Key, Object, Role};

/// Every `[[object]]`, in the file's order.
pub(super) fn objects(root: &Table) -> Result<Vec<Object>> {
    let tables = root.tables("object", "[[object]]", &names("object"))?;
    tables.iter().map(object).collect()
}

fn object(table: &Table) -> Result<Object> {
    let file = table.path("file")?.ok_or_else(|| table.error("file", "is missing"))?;
    let is_character = is_gltf(&file);
    if !is_character && !EXTENSIONS.contains(&extension(&file).as_str()) {
        let what = format!("must be a .glb, .gltf, .obj, .ply or .stl file, not \"{}\"", name(&file));
        return Err(table.error("file", what));
    }
    if let Some(key) = ["node", "clip", "loop"].into_iter().find(|key| table.has(key) && !is_character) {
        return Err(table.error(key, "is for .glb and .gltf files: leave it out"));
    }
    let text = |key| Ok(table.text(key)?.map(str::to_string));
    Ok(Object {
        file,
        node: text("node")?,
        clip: text("clip")?,
        repeat: table.flag("loop")?.unwrap_or(true),
        offset: table.number_in("offset", -1.0e7..=1.0e7, "frames")?.unwrap_or(0.0),
        space: Space {
            scale: table.number_in("scale", 1.0e-9..=1.0e9, "")?.unwrap_or(1.0),
            up: table.choice("up", &[("y", Up::Y), ("z", Up::Z)])?.unwrap_or(Up::Y),
        },
        role: table.choice("role", &ROLES)?.unwrap_or(Role::Collide),
        noise: table.flag("noise")?.unwrap_or(true),
        keys: keys(table)?,
        ease: table.flag("ease")?.unwrap_or(false),
    })
}

/// The roles by name.
pub(super) const ROLES: [(&str, Role); 3] =
    [("collide", Role::Collide), ("static", Role::Static), ("ignore", Role::Ignore)];

fn keys(object: &Table) -> Result<Vec<Key>> {
    let mut keys: Vec<Key> = Vec::new();
    for table in object.tables("keys", "keys of [[object]]", &["frame", "at", "turn_deg"])? {
        let frame = table.number_in("frame", -1.0e8..=1.0e8, "")?;
        let frame = frame.ok_or_else(|| table.error("frame", "is missing"))?;
        if keys.last().is_some_and(|before| before.frame >= frame) {
            return Err(table.error("frame", "must be greater than the key's before it"));
        }
        let at = table.numbers("at")?.unwrap_or([0.0; 3]);
        if at.iter().any(|value: &f64| value.abs() > FAR) {
            return Err(table.error("at", format!("must lie within {FAR} m of the origin")));
        }
        let turn_deg = table.numbers("turn_deg")?.unwrap_or([0.0; 3]);
        if turn_deg.iter().any(|value: &f64| value.abs() > 1.0e6) {
            return Err(table.error("turn_deg", "must lie in -1000000 to 1000000 degrees"));
        }
        keys.push(Key { frame, at, turn_deg });
    }
    Ok(keys)
}
