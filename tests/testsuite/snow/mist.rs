//! Mist: what it flows around, wind, exact states, and what a step refuses.

use frazil::flow::{Faces, Solids, Tiles};
use frazil::geometry::DVec3;
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::snow::mist::{Boundary, Grids, Mist, Params, Source, Start, StepInputs, Surroundings, Wind};
use frazil::sweep::Body;
use frazil::{Context, Error};

use crate::common::liquids::context;
use crate::common::shapes::{cuboid, sphere};

const CELL: f64 = 0.02;
const FRAME: f64 = 1.0 / 24.0;

fn open(tiles: &Tiles, _: f32, _: f64) -> frazil::Result<Solids> {
    Ok(Solids::none(tiles))
}

/// Around mist: grains, and what else there is.
fn around<'a>(sources: &'a [Source], boundary: &'a Boundary<'a>) -> StepInputs<'a> {
    StepInputs { sources, boundary, fastest: 0.0, wind: None }
}

fn times(frame: i32) -> [f64; 2] {
    [frame, frame + 1].map(|frame| f64::from(frame) * FRAME)
}

fn grain(position: [f64; 3], velocity: [f32; 3]) -> Source {
    Source { position: DVec3::from(position), velocity, radius: 0.006, start: None }
}

/// A body that moves along x at a speed (m/s) from a position (m).
fn moving(mesh: frazil::geometry::TriMesh, from: [f64; 3], speed: f64) -> Body {
    let key =
        |time: f64| Key { time, at: DVec3::from(from) + DVec3::x() * (speed * time), turn: DVec3::zeros() };
    Body::new(Box::new(Rigid::new(mesh, Keys::new(vec![key(0.0), key(1.0)]).unwrap())), 0.0).unwrap()
}

/// The faces of surroundings after a frame, on tiles from -2 to 2.
fn faces(surroundings: &Surroundings<'_>) -> (Tiles, Solids) {
    let coords: Vec<[i32; 3]> =
        (-2..2).flat_map(|x| (-2..2).flat_map(move |y| (-2..2).map(move |z| [x, y, z]))).collect();
    let tiles = Tiles::new(&coords);
    let walls = surroundings.during([0.0, FRAME], CELL).unwrap();
    let solids = walls.faces(&context(2), &tiles, CELL as f32, 1.0).unwrap();
    (tiles, solids)
}

/// Calls `each` with the position (m) of the centre of every lower face of active cells, its axis, open share and speed.
fn each_face(tiles: &Tiles, solids: &Solids, mut each: impl FnMut(DVec3, usize, f32, f32)) {
    let all_open = Faces::open();
    for slot in 0..tiles.active() {
        let faces = solids.faces(slot).unwrap_or(&all_open);
        for cell in 0..512usize {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            for axis in 0..3 {
                let position = [0, 1, 2].map(|other| {
                    let half = if other == axis { 0.0 } else { 0.5 };
                    (f64::from(tiles.coords()[slot][other] * 8 + at[other] as i32) + half) * CELL
                });
                each(DVec3::from(position), axis, faces.open[axis][cell], faces.speed[axis][cell]);
            }
        }
    }
}

#[test]
fn a_floor_closes_what_lies_below_it_and_cuts_the_faces_that_it_crosses() {
    let floor = 0.013;
    let (tiles, solids) = faces(&Surroundings { base: None, bodies: &[], removing: &[], floor: Some(floor) });
    each_face(&tiles, &solids, |position, axis, open, speed| {
        let wanted = match axis {
            1 => f64::from(u8::from(position.y >= floor)),
            _ => (0.5 + (position.y - floor) / CELL).clamp(0.0, 1.0),
        };
        assert!((f64::from(open) - wanted).abs() < 0.02, "{position} {axis}: {open} {wanted}");
        assert_eq!(speed, 0.0);
    });
}

#[test]
fn faces_of_a_ball_that_moves_cover_it_and_move_as_it_does() {
    let speed = 1.5;
    let ball = moving(sphere(0.1, 24), [0.011, 0.004, -0.007], speed);
    let (tiles, solids) = faces(&Surroundings { base: None, bodies: &[&ball], removing: &[], floor: None });
    let centre = DVec3::new(0.011 + speed * FRAME, 0.004, -0.007);
    let mut covered = [0.0; 3];
    each_face(&tiles, &solids, |position, axis, open, own| {
        covered[axis] += f64::from(1.0 - open) * CELL.powi(3);
        let off = (position - centre).norm() - 0.1;
        if off.abs() > CELL {
            assert_eq!(open, f32::from(u8::from(off > 0.0)), "{position} {axis} {off}");
        }
        let wanted = if axis == 0 && open < 1.0 { speed as f32 } else { 0.0 };
        if off.abs() < CELL {
            assert!((own - wanted).abs() < 1e-3, "{position} {axis}: {own} m/s, open {open}");
        }
    });
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.001;
    for covered in covered {
        assert!((covered / volume - 1.0).abs() < 0.02, "{covered} {volume}");
    }
}

#[test]
fn snow_opens_where_an_object_has_moved_through_it_within_the_step() {
    let ctx = context(2);
    let area = [-0.6, -0.4, 0.6, 0.4];
    let snow = layer(&ctx, &Ground::Plane { height: 0.0, area }, &[], &Cover::Depth(0.2), 0.01, 3.0).unwrap();
    // From -0.35 to -0.25 m on x at first; it moves by 0.1 m.
    let plate = moving(cuboid([0.1, 0.6, 0.3]), [-0.3, 0.2, 0.0], 0.1 / FRAME);
    let coords: Vec<[i32; 3]> =
        (-4..1).flat_map(|x| (-1..2).flat_map(move |y| (-1..1).map(move |z| [x, y, z]))).collect();
    let tiles = Tiles::new(&coords);
    let open = |removing: &[bool], share: f64, at: f64| {
        let surroundings = Surroundings { base: Some(&snow), bodies: &[&plate], removing, floor: Some(0.0) };
        let walls = surroundings.during([0.0, FRAME], CELL).unwrap();
        // In the order of a run: what has opened stays so.
        walls.faces(&ctx, &tiles, CELL as f32, 0.5 * share).unwrap();
        let solids = walls.faces(&ctx, &tiles, CELL as f32, share).unwrap();
        let mut sum = (0.0, 0);
        each_face(&tiles, &solids, |position, axis, open, _| {
            let is_there = (position.x - at).abs() < 0.6 * CELL && position.z.abs() < 0.1;
            if axis == 1 && is_there && (0.05..0.15).contains(&position.y) {
                sum = (sum.0 + open, sum.1 + 1);
            }
        });
        assert!(sum.1 > 0);
        sum.0 / sum.1 as f32
    };
    // Behind it, where it was at the beginning, inside it, and in the snow before it.
    for (share, at, wanted) in [(1.0, -0.29, 1.0), (1.0, -0.33, 1.0), (1.0, -0.21, 0.0), (1.0, -0.09, 0.0)] {
        assert_eq!(open(&[true], share, at), wanted, "{share} {at}");
    }
    for (share, at, wanted) in [(0.5, -0.33, 1.0), (0.5, -0.27, 0.0), (0.5, -0.15, 0.0)] {
        assert_eq!(open(&[true], share, at), wanted, "{share} {at}");
    }
    // One that takes no snow away leaves it closed.
    assert_eq!(open(&[false], 1.0, -0.29), 0.0);
}

#[test]
fn an_open_mesh_closes_the_faces_that_it_crosses() {
    let mut sheet = cuboid([0.2, 0.1, 0.2]);
    // Only its upper side is left: a square.
    sheet.triangles.retain(|triangle| triangle.iter().all(|at| sheet.positions[*at as usize].y > 0.04));
    assert_eq!(sheet.triangles.len(), 2);
    let sheet = moving(sheet, [0.0, -0.04, 0.0], 0.0);
    let (tiles, solids) = faces(&Surroundings { base: None, bodies: &[&sheet], removing: &[], floor: None });
    let mut closed = 0;
    each_face(&tiles, &solids, |position, axis, open, _| {
        let is_inside = position.x.abs() < 0.09 && position.z.abs() < 0.09;
        if axis == 1 && is_inside && (position.y - 0.01).abs() < 0.6 * CELL {
            assert_eq!(open, 0.0, "{position}");
            closed += 1;
        }
        assert!((position.y - 0.01).abs() < 2.0 * CELL || open == 1.0, "{position}");
    });
    assert!(closed >= 2 * 64, "{closed}");
}

/// Mist that grains raise beside a ball, with all that acts on it.
fn busy(threads: usize, frames: std::ops::Range<i32>, state: Option<&[u8]>) -> Mist {
    let ctx = context(threads);
    let params = Params { turbulence: 5.0, turbulence_size: 0.2, confinement: 0.5, ..Params::for_cell(CELL) };
    let mut mist = match state {
        Some(state) => Mist::resume(params, state).unwrap(),
        None => Mist::new(params).unwrap(),
    };
    let ball = moving(sphere(0.08, 12), [-0.1, 0.05, 0.0], 1.0);
    for frame in frames {
        let surroundings = Surroundings { base: None, bodies: &[&ball], removing: &[], floor: Some(0.0) };
        let walls = surroundings.during(times(frame), CELL).unwrap();
        let boundary = |tiles: &Tiles, cell: f32, share: f64| walls.faces(&ctx, tiles, cell, share);
        let sources: Vec<Source> = (0..40)
            .map(|n| {
                grain([0.01 * f64::from(n) - 0.2, 0.1, 0.003 * f64::from(n % 7)], [1.0, 3.0, 0.1 * n as f32])
            })
            .collect();
        let wind = |_: &Context, positions: &[DVec3]| {
            Ok(positions.iter().map(|at| [at.y as f32, 0.0, 1.0]).collect())
        };
        let around =
            StepInputs { sources: &sources, boundary: &boundary, fastest: 1.0, wind: Some(&Wind(&wind)) };
        let report = mist.step(&ctx, &around, times(frame)).unwrap();
        assert!(report.divergence < 1e-4 && report.mass > 0.0 && report.sub_steps > 1, "{report:?}");
        assert!(report.fastest < 20.0, "{report:?}");
    }
    mist
}

#[test]
fn a_resumed_run_goes_on_with_the_same_bytes_from_any_number_of_threads() {
    let once = busy(2, 0..6, None).save();
    assert!(busy(1, 0..6, None).save() == once);
    let half = busy(2, 0..3, None).save();
    assert!(busy(1, 3..6, Some(&half)).save() == once);
    // What a host sees is made of it alone.
    let copy = Mist::resume(Params::for_cell(CELL), &once).unwrap();
    assert!(copy.save() == once && copy.clone().save() == once);
    let grids = Grids::of(&context(2), &copy).unwrap();
    let voxel = grids.density.index_to_world(DVec3::zeros());
    assert_eq!(voxel, DVec3::repeat(0.5 * CELL));
    assert!(grids.density.active_voxels() > 1000);
}

#[test]
fn damaged_states_are_a_sentence() {
    let state = busy(2, 0..1, None).save();
    let params = || Params::for_cell(CELL);
    for cut in [0, 7, 23, state.len() / 2, state.len() - 1] {
        let error = Mist::resume(params(), &state[..cut]).unwrap_err();
        assert!(matches!(error, Error::Bytes(_)), "{error}");
    }
    for at in (0..state.len()).step_by(state.len() / 200) {
        let mut other = state.clone();
        other[at] ^= 1;
        assert!(Mist::resume(params(), &other).is_err(), "{at}");
    }
    assert!(Mist::resume(Params { wind: [1.0, 0.0, 0.0], ..params() }, &state).is_err());
    assert!(Mist::resume(Params::for_cell(0.03), &state).is_err());
}

#[test]
fn a_step_that_is_cancelled_or_fails_changes_nothing() {
    let ctx = context(2);
    let mut mist = busy(2, 0..2, None);
    let before = mist.save();
    let stops = |tiles: &Tiles, cell: f32, share: f64| {
        if share > 0.5 {
            ctx.cancel();
        }
        open(tiles, cell, share)
    };
    let fast = [grain([0.0; 3], [9.0, 9.0, 0.0])];
    assert!(matches!(mist.step(&ctx, &around(&fast, &stops), times(2)), Err(Error::Cancelled)));
    assert!(mist.save() == before);
    ctx.reset();
    let fails = |_: &Tiles, _: f32, _: f64| Err(Error::argument("no boundary"));
    assert!(mist.step(&ctx, &around(&fast, &fails), times(2)).is_err());
    assert!(mist.save() == before);
    ctx.set_memory_limit(1 << 20);
    let error = mist.step(&ctx, &around(&fast, &open), times(2)).unwrap_err();
    assert!(matches!(error, Error::Memory { .. }), "{error}");
    assert!(mist.save() == before);
}

#[test]
fn what_a_step_cannot_take_is_named() {
    let ctx = context(1);
    let mut mist = Mist::new(Params::for_cell(CELL)).unwrap();
    let mut refuses = |source: Source, words: &str| {
        let error = mist.step(&ctx, &around(&[source], &open), times(0)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refuses(grain([f64::NAN, 0.0, 0.0], [0.0, 5.0, 0.0]), "origin");
    refuses(grain([1e9, 0.0, 0.0], [0.0, 5.0, 0.0]), "origin");
    refuses(grain([0.0; 3], [0.0, f32::INFINITY, 0.0]), "velocity");
    refuses(Source { radius: 50.0, ..grain([0.0; 3], [0.0, 5.0, 0.0]) }, "radius");
    refuses(Source { radius: f64::NAN, ..grain([0.0; 3], [0.0, 5.0, 0.0]) }, "radius");
    refuses(grain([0.0; 3], [0.0, 1e7, 0.0]), "mist moves at");
    let nan = |_: &Context, positions: &[DVec3]| Ok(vec![[f32::NAN; 3]; positions.len()]);
    let source = [grain([0.0; 3], [0.0, 5.0, 0.0])];
    let around = StepInputs { wind: Some(&Wind(&nan)), ..around(&source, &open) };
    let error = mist.step(&ctx, &around, times(0)).unwrap_err().to_string();
    assert!(error.contains("the wind at (") && error.contains("1000 m/s"), "{error}");
    let storm = |_: &Context, positions: &[DVec3]| Ok(vec![[0.0, 1.0e20, 0.0]; positions.len()]);
    let around = StepInputs { wind: Some(&Wind(&storm)), ..around };
    assert!(mist.step(&ctx, &around, times(0)).unwrap_err().to_string().contains("1000 m/s"));
    assert!(mist.step(&ctx, &around, [1.0, 1.0]).is_err());
    for params in [
        Params { gravity: f64::NAN, ..Params::for_cell(CELL) },
        Params { half_life: 0.0, ..Params::for_cell(CELL) },
        Params { turbulence_size: CELL, ..Params::for_cell(CELL) },
        Params::for_cell(0.0),
    ] {
        assert!(Mist::new(params).is_err());
    }
}

/// Where the mist is (m), weighted by its density.
fn middle(mist: &Mist) -> DVec3 {
    let (mut sum, mut weights) = (DVec3::zeros(), 0.0);
    for (coord, tile) in mist.flow().tiles().coords().iter().zip(mist.flow().density()) {
        for (cell, density) in tile.iter().enumerate() {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            let position = [0, 1, 2].map(|axis| (f64::from(coord[axis] * 8 + at[axis] as i32) + 0.5) * CELL);
            sum += DVec3::from(position) * f64::from(*density);
            weights += f64::from(*density);
        }
    }
    sum / weights
}

#[test]
fn wind_carries_mist_and_a_field_of_it_draws_it_along() {
    let ctx = context(2);
    let blown = |wind: [f64; 3], field: Option<[f32; 3]>| {
        let mut mist =
            Mist::new(Params { wind, gravity: 0.0, noise: 0.0, ..Params::for_cell(CELL) }).unwrap();
        let velocity = wind.map(|x| x as f32);
        mist.add(&[[-1, 0, 0], [0, 0, 0]], |cell| {
            let square: i32 = [cell[0], cell[1] - 4, cell[2] - 4].iter().map(|x| x * x).sum();
            (f32::from(u8::from(square < 12)), velocity)
        });
        let start = middle(&mist);
        let sample = |_: &Context, positions: &[DVec3]| Ok(vec![field.unwrap_or_default(); positions.len()]);
        let field = Wind(&sample);
        for frame in 0..12 {
            let wind = (wind == [0.0; 3]).then_some(&field);
            mist.step(&ctx, &StepInputs { wind, ..around(&[], &open) }, times(frame)).unwrap();
        }
        middle(&mist) - start
    };
    let along = DVec3::new(1.0, 0.0, -0.5) * (12.0 * FRAME);
    let carried = blown([1.0, 0.0, -0.5], None);
    assert!((carried - along).norm() < 0.2 * CELL, "{carried} {along}");
    // It takes the wind's speed on in a tenth of a second each half, so it lags by 0.1 s / ln 2.
    let drawn = blown([0.0; 3], Some([1.0, 0.0, -0.5]));
    let lag = 0.1 / std::f64::consts::LN_2;
    let wanted = DVec3::new(1.0, 0.0, -0.5) * (12.0 * FRAME - lag * (1.0 - (-12.0 * FRAME / lag).exp()));
    assert!((drawn - wanted).norm() < 0.3 * wanted.norm(), "{drawn} {wanted}");
    assert!(blown([0.0; 3], Some([0.0; 3])).norm() < 1e-12);
}

#[test]
fn mirrored_winds_make_mirrored_mist() {
    let ctx = context(2);
    let blown = |along: f32| {
        let params = Params { gravity: 0.0, noise: 0.0, confinement: 0.5, ..Params::for_cell(CELL) };
        let mut mist = Mist::new(params).unwrap();
        mist.add(&[[-1, 0, 0], [0, 0, 0]], |cell| {
            let square: f32 = [cell[0] as f32 + 0.5, cell[1] as f32 - 4.0, cell[2] as f32 - 4.0]
                .iter()
                .map(|x| x * x)
                .sum();
            ((3.5 - square.sqrt()).clamp(0.0, 1.0), [0.0, 1.0, 0.0])
        });
        // Air runs together in the middle, and apart on the other side.
        let sample = |_: &Context, positions: &[DVec3]| {
            Ok(positions.iter().map(|at| [along * (1.0 + at.y as f32), 0.0, 0.0]).collect())
        };
        let field = Wind(&sample);
        for frame in 0..6 {
            mist.step(&ctx, &StepInputs { wind: Some(&field), ..around(&[], &open) }, times(frame)).unwrap();
        }
        mist
    };
    let [one, other] = [1.5, -1.5].map(blown);
    let (tiles, mirror) = (one.flow().tiles(), other.flow().tiles());
    assert_eq!(tiles.active(), mirror.active());
    let (mut most, mut off) = (0.0f32, 0.0f32);
    for (coord, tile) in tiles.coords().iter().zip(one.flow().density()) {
        let slot = mirror.find([-1 - coord[0], coord[1], coord[2]]).unwrap() as usize;
        for (cell, density) in tile.iter().enumerate() {
            most = most.max(*density);
            off = off.max((density - other.flow().density()[slot][cell ^ 0o700]).abs());
        }
    }
    assert!(most > 0.3 && off < 1.0e-4 * most, "{off} of {most}");
}

#[test]
fn only_fast_grains_that_rise_raise_mist() {
    let ctx = context(1);
    let raised = |source: Source, falling: bool| {
        let mut mist = Mist::new(Params { falling, ..Params::for_cell(CELL) }).unwrap();
        let report = mist.step(&ctx, &around(&[source], &open), times(0)).unwrap();
        (report.sources, report.mass > 0.0)
    };
    let [slow, rising, falling] = [1.9, 3.0, -3.0].map(|y| grain([0.0; 3], [0.0, y, 0.0]));
    assert_eq!(raised(slow, true), (0, false));
    assert_eq!(raised(rising, false), (1, true));
    assert_eq!(raised(falling, false), (0, false));
    assert_eq!(raised(falling, true), (1, true));
}

/// Mist (m3) after a sixth of a second, and where its middle is (m), of grains that lie still until they are thrown, one after
/// another, in frames of 1 / `fps` (s).
fn thrown(fps: f64) -> (f64, DVec3) {
    let ctx = context(2);
    let mut mist = Mist::new(Params::for_cell(CELL)).unwrap();
    let at = |n: i32, time: f64| {
        let from = DVec3::new(0.03 * f64::from(n % 5), 0.05, 0.02 * f64::from(n / 5));
        let time = time - (0.009 + 0.0131 * f64::from(n % 7));
        let velocity = DVec3::new(0.2, 3.0, 1.0 + 0.1 * f64::from(n % 3));
        match time > 0.0 {
            true => {
                let now = velocity - DVec3::y() * (9.81 * time);
                let position = from + (velocity + now) * (0.5 * time);
                Start { position, velocity: [now.x as f32, now.y as f32, now.z as f32] }
            }
            false => Start { position: from, velocity: [0.0; 3] },
        }
    };
    for frame in 0..(fps / 6.0).round() as i32 {
        let times = [frame, frame + 1].map(|frame| f64::from(frame) / fps);
        let source = |n: i32| {
            let Start { position, velocity } = at(n, times[1]);
            Source { position, velocity, radius: 0.006, start: Some(at(n, times[0])) }
        };
        let sources: Vec<Source> = (0..35).map(source).collect();
        mist.step(&ctx, &around(&sources, &open), times).unwrap();
    }
    (mist.mass(), middle(&mist))
}

#[test]
fn mist_is_the_same_at_every_frame_rate() {
    let [(a, low), (b, middle), (c, high)] = [24.0, 48.0, 96.0].map(thrown);
    assert!((a / c - 1.0).abs() < 0.03 && (b / c - 1.0).abs() < 0.02, "{a} {b} {c}");
    assert!((low - high).norm() < 0.2 * CELL && (middle - high).norm() < 0.1 * CELL, "{low} {middle} {high}");
}

#[test]
fn a_grain_that_is_hit_raises_mist_from_where_it_lay() {
    let ctx = context(1);
    let from = DVec3::new(0.11, 0.01, 0.01);
    // It was hit half way through the frame; its velocity then led it here.
    let velocity = [0.0, 6.0f32, 0.0];
    let position = from + DVec3::y() * (6.0 * 0.5 * FRAME);
    let lowest = |start: Option<Start>| {
        let mut mist = Mist::new(Params { noise: 0.0, gravity: 0.0, ..Params::for_cell(CELL) }).unwrap();
        let source = Source { start, ..grain(position.into(), velocity) };
        mist.step(&ctx, &around(&[source], &open), times(0)).unwrap();
        let mut lowest = f64::INFINITY;
        for (coord, tile) in mist.flow().tiles().coords().iter().zip(mist.flow().density()) {
            for cell in (0..512usize).filter(|cell| tile[*cell] > 0.1) {
                lowest = lowest.min((f64::from(coord[1] * 8 + (cell >> 3 & 7) as i32) + 0.5) * CELL);
            }
        }
        lowest
    };
    let known = lowest(Some(Start { position: from, velocity: [0.0; 3] }));
    assert!(known > from.y - 2.0 * CELL, "{known}");
    // Nothing is known of where it was: it came from as far below.
    let unknown = lowest(None);
    assert!(unknown < known - 2.0 * CELL, "{unknown} {known}");
}

#[test]
fn a_few_grains_open_few_tiles() {
    let ctx = context(1);
    let mut mist = Mist::new(Params::for_cell(CELL)).unwrap();
    // In the middle of a tile: its path stays in it.
    let middle = [3.5 * CELL, 4.5 * CELL, 4.5 * CELL];
    let report = mist.step(&ctx, &around(&[grain(middle, [0.0, 2.1, 0.0])], &open), [0.0, 0.001]).unwrap();
    // One tile that holds mist, and those that share a face or an edge with it.
    assert_eq!(report.cells, 19 * 512, "{report:?}");
}
