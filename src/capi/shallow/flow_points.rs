//! Flow points of a host, which may move with triangles of the ground.

use super::ground::Terrain;
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::shallow::sources::{FlowPoint, Kind, Pulse};

/// Flag of a flow point: it lies on a triangle of the mesh that the liquid was created with, and moves with it.
pub const FRZ_SHALLOW_ON_TRIANGLE: u32 = 1;

/// Kinds of flow points.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_flow_kind {
    /// Liquid enters.
    FRZ_SHALLOW_SOURCE = 0,
    /// Liquid leaves, as long as there is some below: suction.
    FRZ_SHALLOW_DRAIN = 1,
    /// A drain that stops once it has taken frz_shallow_flow.capacity: gauze.
    FRZ_SHALLOW_ABSORBER = 2,
    /// A hole in the ground, through which liquid runs out by its own weight: frz_shallow_flow.opening times (2 g H)^(1/2) per second, H
    /// being the mean depth in its circle (Torricelli's law), but at most its rate.
    FRZ_SHALLOW_ORIFICE = 3,
}

use frz_shallow_flow_kind::*;

const KINDS: Meanings<fn(&frz_shallow_flow) -> Kind, 4> = [
    (FRZ_SHALLOW_SOURCE as u32, |_| Kind::Source),
    (FRZ_SHALLOW_DRAIN as u32, |_| Kind::Drain),
    (FRZ_SHALLOW_ABSORBER as u32, |given| Kind::Absorber(given.capacity)),
    (FRZ_SHALLOW_ORIFICE as u32, |given| Kind::Orifice(given.opening)),
];

/// A flow point, where liquid enters or leaves. Zero it, then set struct_size.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_flow {
    /// sizeof(frz_shallow_flow), the same in all flow points of a call.
    pub struct_size: u32,
    /// 0 or FRZ_SHALLOW_ON_TRIANGLE.
    pub flags: u32,
    /// A frz_shallow_flow_kind.
    pub kind: u32,
    /// With FRZ_SHALLOW_ON_TRIANGLE: index of the triangle, among those that frz_mesh_read lists as FRZ_MESH_TRIANGLES; else 0.
    pub triangle: u32,
    /// With FRZ_SHALLOW_ON_TRIANGLE: barycentric coordinates of the position on the triangle, finite, with a sum of 1; otherwise ignored.
    pub shares: [f64; 3],
    /// Without FRZ_SHALLOW_ON_TRIANGLE: the position (m). It acts on the nearest ground above or below it.
    pub at: [f64; 3],
    /// Radius (m), 0 or more: the point acts on cells whose centres lie within it, seen from above; on the nearest cell if there are none.
    pub radius: f64,
    /// Volume per second (m3/s), 0 or more: 1 ml/s is 1e-6. For an orifice the maximum.
    pub rate: f64,
    /// Volume that an absorber takes (m3), 0 or more; otherwise ignored.
    pub capacity: f64,
    /// Frequency at which the rate pulses (Hz), 0 or more; 0: it does not.
    pub pulse_frequency: f64,
    /// Amplitude of the pulse as a share of the rate, 0 to 1: a sine from the start of the simulated time.
    pub pulse_share: f64,
    /// For an orifice: its area (m2) times the share of it that the jet fills, 0.6 to 0.65 for a sharp edge, 0 or more; otherwise ignored.
    pub opening: f64,
}

sized32!(frz_shallow_flow);

/// A flow point, and the triangle that it moves with.
pub(in crate::capi) struct AttachedFlow {
    /// The flow point at its current position.
    pub point: FlowPoint,
    /// Index of the triangle, and the barycentric coordinates on it.
    pub triangle: Option<(u32, [f64; 3])>,
}

impl AttachedFlow {
    pub fn of(given: &frz_shallow_flow, terrain: &Terrain) -> Outcome<Self> {
        no_flags(given.flags, FRZ_SHALLOW_ON_TRIANGLE)?;
        let kind = meaning("kind", "frz_shallow_flow_kind", given.kind, &KINDS)?(given);
        let is_attached = given.flags & FRZ_SHALLOW_ON_TRIANGLE != 0;
        let triangle = is_attached.then_some((given.triangle, given.shares));
        if let Some((_, shares)) = &triangle {
            let sum: f64 = shares.iter().sum();
            let is_one = (sum - 1.0).abs() < 1e-6;
            refuse(!is_one, || format!("the sum of the shares {shares:?} is not 1"))?;
        }
        let at = triangle.as_ref().map_or(Ok(given.at), |triangle| terrain.position(triangle))?;
        let pulse = Pulse { frequency: given.pulse_frequency, share: given.pulse_share };
        let pulse = (pulse.frequency != 0.0).then_some(pulse);
        Ok(Self { point: FlowPoint { kind, at, radius: given.radius, rate: given.rate, pulse }, triangle })
    }
}
