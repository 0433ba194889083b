//! Points of binary USD files: those of the one prim of the type Points. `velocities` become v, `ids` id, and `widths` pscale, which is half
//! of a width, in metres; primvars keep their names. Transforms are applied.

use super::ParticleColumns;
use crate::geometry::DVec3;
use crate::io::files::numbers::{Kind, Numbers};
use crate::io::files::source::Parsed;
use crate::io::usd::binary::ReadPrim;
use crate::io::usd::layer::Value;
use crate::io::usd::read::UsdFile;

/// Prefix of the names of primvars.
const PRIMVARS: &str = "primvars:";

/// Whether a file holds points and no mesh.
pub(super) fn holds_points(bytes: &[u8]) -> bool {
    UsdFile::open(bytes).is_ok_and(|file| file.has("Points") && !file.has("Mesh"))
}

pub(super) fn parse(bytes: &[u8]) -> Parsed<ParticleColumns> {
    let file = UsdFile::open(bytes)?;
    let prims = file.prims("Points", "points")?;
    let [prim] = prims[..] else {
        return Err(format!("it has {} prims of points, and files with one are read", prims.len()));
    };
    points(&file, prim).map_err(|what| format!("{}: {what}", prim.path))
}

fn points(file: &UsdFile<'_>, prim: &ReadPrim) -> Parsed<ParticleColumns> {
    let positions = file.positions(prim, DVec3::zeros())?;
    let count = positions.len();
    let flat = |vectors: &[DVec3]| Numbers::Floats(vectors.iter().flatten().copied().collect());
    let mut out = ParticleColumns::new(flat(&positions));
    if let Some(velocities) = file.velocities(prim, count)? {
        out.add("v", Kind::F32, 3, flat(&velocities))?;
    }
    for attribute in &prim.attributes {
        let name = match &*attribute.name {
            "ids" => "id",
            "widths" => "pscale",
            name => match name.strip_prefix(PRIMVARS) {
                Some(name) if !name.ends_with(":indices") => name,
                _ => continue,
            },
        };
        let Some((kind, components, mut numbers)) = file.value(prim, &attribute.name)?.and_then(numbers)
        else {
            out.leave_out(name);
            continue;
        };
        if name == "pscale"
            && let Numbers::Floats(widths) = &mut numbers
        {
            let half = file.scale(prim)? / 2.0;
            widths.iter_mut().for_each(|width| *width *= half);
        }
        // One value for all.
        if attribute.interpolation == "constant" && numbers.count() == components {
            numbers = repeated(numbers, count);
        }
        out.add(name, kind, components, numbers)?;
    }
    Ok(out)
}

/// The numbers of an array, with their type and the count of those of each element; none if points cannot have them.
fn numbers(value: Value) -> Option<(Kind, usize, Numbers)> {
    fn integers<T: Into<i64>>(values: Vec<T>) -> Numbers {
        Numbers::Integers(values.into_iter().map(Into::into).collect())
    }
    fn floats<T: Into<f64>>(values: impl IntoIterator<Item = T>) -> Numbers {
        Numbers::Floats(values.into_iter().map(Into::into).collect())
    }
    Some(match value {
        Value::Bools(values) => (Kind::U8, 1, integers(values)),
        Value::Ints(values) => (Kind::I32, 1, integers(values)),
        Value::Uints(values) => (Kind::U32, 1, integers(values)),
        Value::Longs(values) => (Kind::I64, 1, integers(values)),
        Value::Floats(values) => (Kind::F32, 1, floats(values)),
        Value::Doubles(values) => (Kind::F64, 1, floats(values)),
        Value::Pairs(values) => (Kind::F32, 2, floats(values.into_iter().flatten())),
        Value::Vectors(values) => (Kind::F32, 3, floats(values.into_iter().flatten())),
        Value::DoubleVectors(values) => (Kind::F64, 3, floats(values.into_iter().flatten())),
        _ => return None,
    })
}

/// The same numbers for each of `count` elements.
fn repeated(numbers: Numbers, count: usize) -> Numbers {
    match numbers {
        Numbers::Integers(numbers) => Numbers::Integers(numbers.repeat(count)),
        Numbers::Floats(numbers) => Numbers::Floats(numbers.repeat(count)),
    }
}
