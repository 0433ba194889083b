//! Moving bodies, as a host describes them for one step.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use rayon::prelude::*;

use crate::capi::ffi::*;
use crate::capi::mesh::triangles::{no_flags, polygons};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::mesh::{renumbered, used};
use crate::geometry::{DVec3, PolygonMesh, Vec3};
use crate::motion::{Motion, between};
use crate::snow::grains::Object;
use crate::sweep::{Body, Shape};

/// A mesh that moves during a step. All arrays are lent for the duration of the call.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_body {
    /// sizeof(frz_body), the same in all bodies of a call.
    pub struct_size: u32,
    /// 0, FRZ_BODY_EXACT, FRZ_BODY_COMPRESSION or both.
    pub flags: u32,
    /// An id chosen by the host, different in all bodies of a call and the same for the body in every step. It saves work while a body
    /// keeps its faces; results do not depend on it.
    pub id: u64,
    /// float[3] for each vertex (m), finite: its position at the beginning of the step.
    pub positions: frz_view,
    /// float[3] for each vertex (m), finite: its position at the end of the step. data NULL: the body does not move.
    pub positions_end: frz_view,
    /// Poses at equal intervals between positions and positions_end, each float[3] for each vertex; vertices move straight from pose to
    /// pose. NULL for none, as it must be without positions_end.
    pub between: *const frz_view,
    /// Number of poses in between.
    pub between_count: usize,
    /// As in frz_mesh_desc.
    pub face_counts: frz_view,
    /// As in frz_mesh_desc. Where open meshes press into snow or are swept they are closed, with a warning.
    pub indices: frz_view,
    /// Friction of grains against it, 0 to 10; only grains use it. It holds them, and carries them along while the body moves; loose grains
    /// that slide over a body at rest are subject to the friction between grains instead. frz_body_init sets 0.3, which also applies to
    /// headers of interface 1.1, without this field.
    pub friction: f64,
    /// Adhesion to grains that touch it (weights of a grain), 0 to 1000; only grains use it.
    pub stick: f64,
    /// Replaces frz_grains_params.compression, 0 to 1; only with FRZ_BODY_COMPRESSION, and only grains use it. Where bodies with different
    /// values have removed snow, the body whose surface came nearest to a position decides there.
    pub compression: f64,
}

sized32!(frz_body, [friction], Self { friction: 0.3, ..Self::zeroed() });

/// Flag of a body: its imprints have no noise.
pub const FRZ_BODY_EXACT: u32 = 1;

/// Flag of a body: frz_body.compression replaces frz_grains_params.compression for the snow that the body removes.
pub const FRZ_BODY_COMPRESSION: u32 = 2;

/// Fills a body with the defaults: no arrays, a friction of 0.3.
///
/// body: receives the defaults.
/// size: sizeof(frz_body).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_body_init(body: *mut frz_body, size: usize) -> frz_status {
    // SAFETY: the body is NULL or has `size` bytes.
    guard(|| unsafe { fill(body, Some(size), frz_body::defaults()) })
}

/// Maximum number of poses between the beginning and the end of a step.
const MAX_BETWEEN: usize = 4096;

/// Motion of a host's body: linear from pose to pose, the first at time 0, the last at the step's end.
struct HostMotion {
    triangles: Vec<[u32; 3]>,
    poses: Vec<Vec<Vec3>>,
    /// Length of the step (s).
    end: f64,
}

impl HostMotion {
    /// Takes poses of all of the host's vertices, and drops the vertices that no triangle uses.
    fn new(triangles: Vec<[u32; 3]>, mut poses: Vec<Vec<Vec3>>, end: f64) -> Self {
        let Some(used) = used(poses[0].len(), &triangles) else { return Self { triangles, poses, end } };
        for pose in &mut poses {
            *pose = used.iter().map(|&vertex| pose[vertex as usize]).collect();
        }
        Self { triangles: renumbered(&triangles, &used), poses, end }
    }
}

impl Motion for HostMotion {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    fn vertex_count(&self) -> usize {
        self.poses[0].len()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let steps = self.poses.len() - 1;
        let at = if self.end > 0.0 { (time / self.end).clamp(0.0, 1.0) * steps as f64 } else { 0.0 };
        // The times of poses are quotients: rounding must not mix in a neighbouring pose.
        let at = if (at - at.round()).abs() < 1e-9 { at.round() } else { at };
        let (first, part) = (at.floor() as usize, at - at.floor());
        between(&self.poses[first], &self.poses[(first + 1).min(steps)], part, out);
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        let steps = self.poses.len() - 1;
        let times = (1..steps).map(|step| self.end * step as f64 / steps as f64);
        times.filter(|&time| time > from && time < to).collect()
    }
}

/// A body from a host, checked.
struct HostBody {
    id: u64,
    exact: bool,
    surface: Surface,
    mesh: PolygonMesh,
    poses: Vec<Vec<Vec3>>,
}

/// Surface properties of a body, for grains.
#[derive(Clone, Copy)]
pub(in crate::capi) struct Surface {
    friction: f64,
    stick: f64,
    compression: Option<f64>,
}

impl Surface {
    /// A body with these surface properties.
    pub(in crate::capi) fn object<'a>(&self, body: &'a Body) -> Object<'a> {
        Object { stick: self.stick, compression: self.compression, ..Object::new(body, self.friction) }
    }
}

/// Shapes of a host's bodies by id, kept from step to step.
pub(in crate::capi) type Shapes = HashMap<u64, Arc<Shape>>;

/// What bodies do in a call.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in crate::capi) enum Role {
    /// Their swept volume is removed or built.
    Sweep,
    /// They push grains.
    Push,
    /// They bound the air and carry it along.
    Bound,
}

/// Maximum distance from the origin (m) of a body that pushes grains or bounds the air.
const FARTHEST: f32 = 1.0e6;

/// Bodies from a host's arrays, checked, each with its surface. `shapes` holds the shapes of earlier calls, and is updated.
///
/// # Safety
/// The bodies must describe memory that can be read.
pub(in crate::capi) unsafe fn bodies(
    ctx: &Context,
    list: *const frz_body,
    count: usize,
    dt: f64,
    role: Role,
    shapes: &mut Shapes,
) -> Outcome<Vec<(Body, Surface)>> {
    finite("dt", dt)?;
    refuse(dt < 0.0, || format!("dt = {dt} is not 0 or more"))?;
    // SAFETY: guaranteed by the caller.
    let read_bodies = unsafe { read_bodies(list, count, dt) }?;
    if role != Role::Sweep {
        for (at, body) in read_bodies.iter().enumerate() {
            check_far(body).map_err(|failure| named(at, failure))?;
        }
    }
    let bytes = read_bodies
        .iter()
        .map(|body| body.poses.len() * body.poses[0].len() * 12 + body.mesh.corners.len() * 200);
    ctx.allow("the bodies", bytes.sum::<usize>() as u64)?;
    let known = &*shapes;
    let make = |body: HostBody| {
        ctx.check()?;
        ctx.advance();
        let motion = HostMotion::new(body.mesh.triangles(), body.poses, dt);
        let made = Body::shaped(Box::new(motion), 0.0, known.get(&body.id).cloned())?;
        Ok((body.id, made.with_noise(!body.exact), body.surface))
    };
    let made: Vec<(u64, Body, Surface)> = ctx.phase("bodies", || {
        ctx.expect(read_bodies.len());
        read_bodies.into_par_iter().map(make).collect::<Result<_>>()
    })?;
    made.iter().for_each(|(id, body, _)| warn(ctx, role, *id, body, shapes.get(id)));
    *shapes = made.iter().map(|(id, body, _)| (*id, body.shape().clone())).collect();
    Ok(made.into_iter().map(|(_, body, surface)| (body, surface)).collect())
}

/// Logs warnings about a body, once until its faces change.
fn warn(ctx: &Context, role: Role, id: u64, body: &Body, known: Option<&Arc<Shape>>) {
    if known.is_some_and(|known| Arc::ptr_eq(known, body.shape())) {
        return;
    }
    for what in body.doubts().map(String::from).into_iter().chain(body.weld_warning()) {
        ctx.warn(&format!("body {id}: {what}"));
    }
    let (loops, edges) = (body.closed_loops(), body.contradictions());
    if role == Role::Push && loops + edges > 0 {
        ctx.warn(&format!("body {id}: the mesh has no inside: grains collide with both of its sides"));
        return;
    }
    // Steps of the air warn about holes themselves: they close only small ones.
    if role == Role::Bound {
        return;
    }
    if loops > 0 {
        ctx.warn(&format!("body {id}: {loops} open loops of the mesh are closed"));
    }
    if edges > 0 {
        ctx.warn(&format!("body {id}: the faces disagree about inside and outside at {edges} edges"));
    }
}

/// Refuses a body that is too far away for its speed to be computed.
fn check_far(body: &HostBody) -> Outcome {
    let is_far = |pose: &[Vec3], vertex: u32| pose[vertex as usize].iter().any(|x| x.abs() > FARTHEST);
    let far_of =
        |pose: &Vec<Vec3>| body.mesh.corners.iter().copied().filter(|&vertex| is_far(pose, vertex)).min();
    match body.poses.iter().find_map(far_of) {
        None => Ok(()),
        Some(vertex) => {
            let text = format!("vertex {vertex} lies more than {FARTHEST} m from the origin along an axis");
            Err(Failure::argument(text))
        }
    }
}

/// Reads a host's bodies, whose ids must differ.
///
/// # Safety
/// As [`bodies`].
unsafe fn read_bodies(list: *const frz_body, count: usize, dt: f64) -> Outcome<Vec<HostBody>> {
    if count == 0 {
        return Ok(Vec::new());
    }
    required(list.cast_mut(), "bodies")?;
    // SAFETY: guaranteed by the caller.
    let stride = unsafe { stride_of(list, count, "bodies", |failure| named(0, failure)) }?;
    let mut out: Vec<HostBody> = Vec::with_capacity(count);
    let mut ids = HashSet::with_capacity(count);
    for at in 0..count {
        // SAFETY: guaranteed by the caller.
        let body =
            unsafe { read_body(list.byte_add(at * stride), dt) }.map_err(|failure| named(at, failure))?;
        refuse(!ids.insert(body.id), || format!("body {at}: another one has the id {} too", body.id))?;
        out.push(body);
    }
    Ok(out)
}

/// Adds the body's index to a failure.
fn named(at: usize, failure: Failure) -> Failure {
    Failure { text: format!("body {at}: {}", failure.text), ..failure }
}

/// # Safety
/// As [`bodies`].
unsafe fn read_body(body: *const frz_body, dt: f64) -> Outcome<HostBody> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        let body = given(body)?;
        no_flags(body.flags, FRZ_BODY_EXACT | FRZ_BODY_COMPRESSION)?;
        within("friction", body.friction, 0.0..=10.0, "")?;
        within("stick", body.stick, 0.0..=1000.0, "")?;
        let has_compression = body.flags & FRZ_BODY_COMPRESSION != 0;
        let compression = has_compression.then_some(body.compression);
        within("compression", compression.unwrap_or(0.0), 0.0..=1.0, "")?;
        let surface = Surface { friction: body.friction, stick: body.stick, compression };
        refuse(body.between_count > MAX_BETWEEN, || {
            format!("between_count = {} is more than {MAX_BETWEEN}", body.between_count)
        })?;
        let mesh = polygons(&body.positions, &body.face_counts, &body.indices)?;
        let count = mesh.positions.len();
        let mut poses = vec![mesh.positions.clone()];
        let moves = !body.positions_end.data.is_null() || body.positions_end.count > 0;
        if body.between_count > 0 && !moves {
            return Err(Failure::argument(
                "between: there are poses, but no positions_end that they lead to",
            ));
        }
        let mut pose = |view: &frz_view, name: &str| -> Outcome {
            let positions = view.finite(name)?;
            refuse(positions.len() != count, || {
                format!("{name}: {} elements, but there are {count} positions", positions.len())
            })?;
            poses.push(positions.into_iter().map(Vec3::from).collect());
            Ok(())
        };
        if dt > 0.0 && moves {
            let list = frz_view::packed(body.between, body.between_count);
            for view in list.elements::<frz_view>("between")? {
                pose(&view, "between")?;
            }
            pose(&body.positions_end, "positions_end")?;
        }
        let exact = body.flags & FRZ_BODY_EXACT != 0;
        Ok(HostBody { id: body.id, exact, surface, mesh, poses })
    }
}
