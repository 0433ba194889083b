//! The liquid at a frame as bytes: its own state, and its obstacles and flow points at that frame, which a resumed run may replace.

use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::bytes::{Reader, Writer};
use crate::numeric::packed;
use crate::numeric::packed::Magic;
use crate::shallow::sources::{FlowPoint, Kind, Pulse};
use crate::shallow::terrain::shapes::Shape;
use crate::shallow::{Shallow, Stains};

/// Magic bytes, including the version.
const MAGIC: &Magic = b"frzsha01";
/// Noun for messages.
const NOUN: &str = "liquid";

/// A saved liquid.
#[derive(Debug, PartialEq)]
pub(in crate::scene::shallow) struct SavedLiquid {
    /// The obstacles that stood in it.
    pub shapes: Vec<Shape>,
    /// Its sources, drains and absorbers.
    pub points: Vec<FlowPoint>,
    /// Its own state.
    pub liquid: Vec<u8>,
    /// Its stains; empty if it does not stain.
    pub stains: Vec<u8>,
}

/// The exact state of a liquid with these obstacles and flow points, and of its stains.
pub(in crate::scene::shallow) fn save(
    shapes: &[Shape],
    points: &[FlowPoint],
    liquid: &Shallow,
    stains: Option<&Stains>,
) -> Vec<u8> {
    let mut to = Writer::default();
    to.count(shapes.len());
    for shape in shapes {
        let (code, numbers) = numbers_of(shape);
        to.u32(code);
        numbers.into_iter().for_each(|number| to.f64(number));
    }
    to.count(points.len());
    for FlowPoint { kind, at, radius, rate, pulse } in points {
        let (code, measure) = match kind {
            Kind::Source => (0, 0.0),
            Kind::Drain => (1, 0.0),
            Kind::Absorber(capacity) => (2, *capacity),
            Kind::Orifice(opening) => (3, *opening),
        };
        to.u32(code);
        to.u32(u32::from(pulse.is_some()));
        let Pulse { frequency, share } = pulse.unwrap_or(Pulse { frequency: 0.0, share: 0.0 });
        let [x, y, z] = *at;
        [measure, x, y, z, *radius, *rate, frequency, share].into_iter().for_each(|number| to.f64(number));
    }
    let mut own = Vec::new();
    liquid.save_into(&mut own);
    to.count(own.len());
    to.0.extend(own);
    if let Some(stains) = stains {
        let own = stains.save();
        to.count(own.len());
        to.0.extend(own);
    }
    packed::pack(&to.0, MAGIC)
}

/// Reads what [`save`] wrote.
///
/// # Errors
/// Bytes that are not such a state.
pub(in crate::scene::shallow) fn read(bytes: &[u8]) -> Result<SavedLiquid> {
    let bytes = packed::unpack(bytes, MAGIC, NOUN)?;
    let mut from = Reader::new(&bytes);
    let count = from.count(4)?;
    let shapes = (0..count).map(|_| shape(&mut from)).collect::<Result<Vec<_>>>()?;
    let count = from.count(8)?;
    let points = (0..count).map(|_| point(&mut from)).collect::<Result<Vec<_>>>()?;
    let length = from.count(1)?;
    let liquid = from.bytes(length)?.to_vec();
    let mut stains = Vec::new();
    if !from.rest().is_empty() {
        let length = from.count(1)?;
        stains = from.bytes(length)?.to_vec();
    }
    from.end()?;
    Ok(SavedLiquid { shapes, points, liquid, stains })
}

fn numbers_of(shape: &Shape) -> (u32, Vec<f64>) {
    let position = |position: &DVec3| <[f64; 3]>::from(*position);
    match shape {
        Shape::Sphere { centre, radius } => (0, [&position(centre)[..], &[*radius]].concat()),
        Shape::Capsule { ends: [a, b], radius } => (1, [&position(a)[..], &position(b), &[*radius]].concat()),
        Shape::Cuboid { centre, axes: [a, b, c], half } => {
            (2, [&position(centre)[..], &position(a), &position(b), &position(c), half].concat())
        }
    }
}

fn shape(from: &mut Reader<'_>) -> Result<Shape> {
    let code = from.u32()?;
    let position = |from: &mut Reader<'_>| Ok::<_, Error>(DVec3::new(from.f64()?, from.f64()?, from.f64()?));
    Ok(match code {
        0 => Shape::Sphere { centre: position(from)?, radius: from.f64()? },
        1 => Shape::Capsule { ends: [position(from)?, position(from)?], radius: from.f64()? },
        2 => Shape::Cuboid {
            centre: position(from)?,
            axes: [position(from)?, position(from)?, position(from)?],
            half: position(from)?.into(),
        },
        _ => return Err(Error::Bytes("has an obstacle of no known shape".into())),
    })
}

fn point(from: &mut Reader<'_>) -> Result<FlowPoint> {
    let (code, has_pulse) = (from.u32()?, from.u32()? != 0);
    let measure = from.f64()?;
    let at = [from.f64()?, from.f64()?, from.f64()?];
    let (radius, rate) = (from.f64()?, from.f64()?);
    let pulse = Pulse { frequency: from.f64()?, share: from.f64()? };
    let kind = match code {
        0 => Kind::Source,
        1 => Kind::Drain,
        2 => Kind::Absorber(measure),
        3 => Kind::Orifice(measure),
        _ => return Err(Error::Bytes("has a flow point of no known kind".into())),
    };
    Ok(FlowPoint { kind, at, radius, rate, pulse: has_pulse.then_some(pulse) })
}
