//! How liquid leaves an edge and lands: in threads, not all at the same time, and not in one column.

use frazil::shallow::free_fall::mesh::{Balls, bound};
use frazil::shallow::free_fall::{Droplet, Falls};
use frazil::shallow::material::Liquid;
use frazil::shallow::sources::Kind;
use frazil::shallow::{Params, Shallow};

use crate::common::flowing::{FRAME, point};
use crate::common::shallow::{context, ground};

const CELL: f64 = 0.001;
/// Where the edge is, and its height over the ground (m).
const EDGE: f64 = 0.0;
const HEIGHT: f64 = 0.06;

/// Water runs over a straight edge, 60 cells long, from a source near it, for some frames.
fn over_an_edge(rate: f64, frames: usize, falls: Falls) -> Shallow {
    let ctx = context();
    let solids = ground([60, 60], CELL, [0.0, 0.2], |[x, _]| if x < EDGE { 0.01 + HEIGHT } else { 0.01 });
    let params = Params { liquid: Liquid::new(1e-6), falls: Some(falls), ..Params::default() };
    let mut liquid = Shallow::new(&ctx, &solids, params).unwrap();
    let at = [-0.012, 0.01 + HEIGHT, 0.0032];
    liquid.set_flows(&[point(Kind::Source, at, 0.004, rate)], |_| "the source".into()).unwrap();
    for _ in 0..frames {
        liquid.step(&ctx, FRAME).unwrap();
        assert_eq!(liquid.balance().error, 0);
    }
    liquid
}

/// The last drop of each overflow edge that flows.
fn last_of(liquid: &Shallow) -> Vec<Droplet> {
    liquid.drops().filter(|drop| drop.overflow_edge.is_some()).collect()
}

#[test]
fn a_film_leaves_an_edge_in_threads_that_stay_where_they_are() {
    let liquid = over_an_edge(4e-6, 90, Falls::default());
    let mut positions: Vec<f64> = last_of(&liquid).iter().map(|drop| drop.position[2]).collect();
    positions.sort_unstable_by(f64::total_cmp);
    // The film is wider than that, and 4 mm are between threads at least.
    assert!((4..=15).contains(&positions.len()), "{positions:?}");
    assert!(positions.windows(2).all(|two| two[1] - two[0] > 0.0039), "{positions:?}");
    let later = over_an_edge(4e-6, 120, Falls::default());
    let stays = last_of(&later);
    let stays = stays.iter().filter(|drop| positions.iter().any(|at| (at - drop.position[2]).abs() < 1e-9));
    assert!(stays.count() * 3 >= positions.len() * 2, "{positions:?}");
}

#[test]
fn threads_do_not_let_go_at_the_same_time() {
    let liquid = over_an_edge(4e-6, 90, Falls::default());
    let mut ages: Vec<u64> = last_of(&liquid).iter().map(|drop| (1e6 * drop.age) as u64).collect();
    ages.sort_unstable();
    ages.dedup();
    assert!(ages.len() >= 4, "{ages:?}");
    assert!(ages.iter().all(|age| *age < 1_000_000 / 60 + 9000), "{ages:?}");
}

#[test]
fn a_strand_joins_the_lip_and_its_last_drop() {
    let liquid = over_an_edge(4e-6, 90, Falls::default());
    let drops: Vec<Droplet> = liquid.drops().collect();
    for drop in &drops {
        let Some(edge) = drop.overflow_edge else { continue };
        let [x, y, z] = edge.position;
        assert!((x - EDGE + 0.5 * CELL).abs() < 1e-9 && (z - drop.position[2]).abs() < 1e-9, "{edge:?}");
        assert!((y - 0.5 * edge.depth - 0.01 - HEIGHT).abs() < 1e-9 && edge.edge == [0.0, 0.0, 1.0]);
        assert!(drops.iter().all(|other| other.source != drop.source || other.number <= drop.number));
    }
    let mut balls = Balls::default();
    let with = balls.count(&drops);
    assert!(with.vertices <= bound(drops.len()).vertices && with.indices <= bound(drops.len()).indices);
    let bare: Vec<Droplet> = drops.iter().map(|drop| Droplet { overflow_edge: None, ..*drop }).collect();
    let strands = (with.extras - balls.count(&bare).extras) / 18;
    assert_eq!(strands, last_of(&liquid).len());
}

#[test]
fn a_little_liquid_drips() {
    let drop = 4e-9;
    let liquid = over_an_edge(2e-7, 300, Falls { drop, ..Falls::default() });
    let drops: Vec<Droplet> = liquid.drops().collect();
    assert!(drops.iter().any(|other| other.volume >= drop && other.volume < 1.5 * drop), "{drops:?}");
    // Each falls alone.
    let pairs = drops.iter().flat_map(|a| drops.iter().map(move |b| (a, b)));
    let mut pairs = pairs.filter(|(a, b)| a.source == b.source && a.number < b.number);
    assert!(pairs.all(|(a, b)| b.number - a.number > 1), "{drops:?}");
}

#[test]
fn what_lands_makes_no_spikes() {
    let liquid = over_an_edge(4e-6, 60, Falls::default());
    let columns = liquid.columns();
    let below = columns.indices().filter(|&column| columns.grid.centre(columns.cell(column))[0] > EDGE);
    let deepest = below.map(|column| liquid.depths()[column]).max().unwrap();
    // A packet of a thread would stand 3 mm high in one column.
    assert!((1..(0.002 / columns.heights.unit) as i32).contains(&deepest), "{deepest}");
}
