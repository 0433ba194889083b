//! Every promise with a number: `make gates [ONLY=prefix,...]`.

#[path = "gates/band.rs"]
mod band;
#[path = "gates/beds.rs"]
mod beds;
#[path = "gates/behind_ground.rs"]
mod behind_ground;
#[path = "gates/births.rs"]
mod births;
#[path = "gates/bytes.rs"]
mod bytes;
#[path = "gates/cancel.rs"]
mod cancel;
#[path = "gates/cancel_latency.rs"]
mod cancel_latency;
#[path = "gates/capi.rs"]
mod capi;
#[path = "gates/collapse.rs"]
mod collapse;
#[path = "gates/collisions.rs"]
mod collisions;
#[path = "gates/columns.rs"]
mod columns;
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "gates/crowd.rs"]
mod crowd;
#[path = "gates/damage.rs"]
mod damage;
#[path = "gates/dense.rs"]
mod dense;
#[path = "gates/detail_kept.rs"]
mod detail_kept;
#[path = "gates/distance.rs"]
mod distance;
#[path = "gates/early.rs"]
mod early;
#[path = "gates/easing.rs"]
mod easing;
#[path = "gates/edit_history.rs"]
mod edit_history;
#[path = "gates/reliability/empty_frames.rs"]
mod empty_frames;
#[path = "gates/far.rs"]
mod far;
#[path = "gates/flip.rs"]
mod flip;
#[path = "gates/free.rs"]
mod free;
#[path = "gates/grain_cancel.rs"]
mod grain_cancel;
#[path = "gates/grain_memory.rs"]
mod grain_memory;
#[path = "gates/grain_readers.rs"]
mod grain_readers;
#[path = "gates/grains.rs"]
mod grains;
#[path = "gates/harness.rs"]
mod harness;
#[path = "gates/host.rs"]
mod host;
#[path = "gates/house.rs"]
mod house;
#[path = "gates/large.rs"]
mod large;
#[path = "gates/matching.rs"]
mod matching;
#[path = "gates/materials.rs"]
mod materials;
#[path = "gates/mist.rs"]
mod mist;
#[path = "gates/mist_cancel.rs"]
mod mist_cancel;
#[path = "gates/mist_eddies.rs"]
mod mist_eddies;
#[path = "gates/mist_passes.rs"]
mod mist_passes;
#[path = "gates/mist_rates.rs"]
mod mist_rates;
#[path = "gates/mist_walls.rs"]
mod mist_walls;
#[path = "gates/oracle.rs"]
mod oracle;
#[path = "gates/reliability/orientation.rs"]
mod orientation;
#[path = "gates/particles.rs"]
mod particles;
#[path = "gates/passes.rs"]
mod passes;
#[path = "gates/piles.rs"]
mod piles;
#[path = "gates/planes.rs"]
mod planes;
#[path = "gates/plates.rs"]
mod plates;
#[path = "gates/plot.rs"]
mod plot;
#[path = "gates/plot_font.rs"]
mod plot_font;
#[path = "gates/poses.rs"]
mod poses;
#[path = "gates/preview.rs"]
mod preview;
#[path = "gates/rate.rs"]
mod rate;
#[path = "gates/readers.rs"]
mod readers;
#[path = "gates/rebuilt.rs"]
mod rebuilt;
#[path = "gates/rebuilt_frames.rs"]
mod rebuilt_frames;
#[path = "gates/rebuilt_large.rs"]
mod rebuilt_large;
#[path = "gates/rebuilt_sequences.rs"]
mod rebuilt_sequences;
#[path = "gates/rebuilt_speed.rs"]
mod rebuilt_speed;
#[path = "gates/rebuilt_topology.rs"]
mod rebuilt_topology;
#[path = "gates/reliability/bugs.rs"]
mod reliability_bugs;
#[path = "gates/reliability/gltf_valid.rs"]
mod reliability_gltf_valid;
#[path = "gates/reliability/guard_page.rs"]
mod reliability_guard_page;
#[path = "gates/reliability/soup.rs"]
mod reliability_soup;
#[path = "gates/reliability/step_calls.rs"]
mod reliability_step_calls;
#[path = "gates/reliability/step_meshes.rs"]
mod reliability_step_meshes;
#[path = "gates/reliability/watch.rs"]
mod reliability_watch;
#[path = "gates/repair.rs"]
mod repair;
#[path = "gates/rest.rs"]
mod rest;
#[path = "gates/rest_kept.rs"]
mod rest_kept;
#[path = "gates/scenes.rs"]
mod scenes;
#[path = "gates/shallow_bowl.rs"]
mod shallow_bowl;
#[path = "gates/shallow_core.rs"]
mod shallow_core;
#[path = "gates/shallow_dam.rs"]
mod shallow_dam;
#[path = "gates/shallow_delivery.rs"]
mod shallow_delivery;
#[path = "gates/shallow_detail.rs"]
mod shallow_detail;
#[path = "gates/shallow_energy.rs"]
mod shallow_energy;
#[path = "gates/shallow_falls.rs"]
mod shallow_falls;
#[path = "gates/shallow_film.rs"]
mod shallow_film;
#[path = "gates/shallow_flooded.rs"]
mod shallow_flooded;
#[path = "gates/shallow_ground.rs"]
mod shallow_ground;
#[path = "gates/shallow_huppert.rs"]
mod shallow_huppert;
#[path = "gates/shallow_incline.rs"]
mod shallow_incline;
#[path = "gates/shallow_lake.rs"]
mod shallow_lake;
#[path = "gates/shallow_lifts.rs"]
mod shallow_lifts;
#[path = "gates/shallow_mass.rs"]
mod shallow_mass;
#[path = "gates/shallow_orifice.rs"]
mod shallow_orifice;
#[path = "gates/shallow_range.rs"]
mod shallow_range;
#[path = "gates/shallow_same.rs"]
mod shallow_same;
#[path = "gates/shallow_scalars.rs"]
mod shallow_scalars;
#[path = "gates/shallow_sleeping.rs"]
mod shallow_sleeping;
#[path = "gates/shallow_speed.rs"]
mod shallow_speed;
#[path = "gates/shallow_spread.rs"]
mod shallow_spread;
#[path = "gates/shallow_state.rs"]
mod shallow_state;
#[path = "gates/shallow_surface.rs"]
mod shallow_surface;
#[path = "gates/shallow_terrain.rs"]
mod shallow_terrain;
#[path = "gates/shallow_threads.rs"]
mod shallow_threads;
#[path = "gates/shallow_walls.rs"]
mod shallow_walls;
#[path = "gates/shallow_whole.rs"]
mod shallow_whole;
#[path = "gates/shot.rs"]
mod shot;
#[path = "gates/snow.rs"]
mod snow;
#[path = "gates/speed.rs"]
mod speed;
#[path = "gates/spin.rs"]
mod spin;
#[path = "gates/splashsurf.rs"]
mod splashsurf;
#[path = "gates/spot.rs"]
mod spot;
#[path = "gates/surface.rs"]
mod surface;
#[path = "gates/surface_readers.rs"]
mod surface_readers;
#[path = "gates/sweeps.rs"]
mod sweeps;
#[path = "gates/table.rs"]
mod table;
#[path = "gates/textures.rs"]
mod textures;
#[path = "gates/tracker_cancel.rs"]
mod tracker_cancel;
#[path = "gates/turned.rs"]
mod turned;
#[path = "gates/volumes.rs"]
mod volumes;
#[path = "gates/vortex.rs"]
mod vortex;
#[path = "gates/windings.rs"]
mod windings;
#[path = "gates/worst.rs"]
mod worst;

use harness::Harness;

fn main() {
    let first = std::env::args().nth(1);
    match first.as_deref() {
        Some(speed::PEAK) => return speed::print_peak(),
        Some(bytes::HASH) => return bytes::print_hash(),
        Some(grain_memory::MEMORY) => return grain_memory::print_memory(),
        Some(mist::MEMORY) => return mist::print_memory(),
        Some(rebuilt_large::MILLION) => return rebuilt_large::print_million(),
        Some(damage::FUZZ) => return damage::read_mutated(),
        Some(shallow_same::HASH) => return shallow_same::print_hash(),
        Some(shallow_same::SURFACES) => return shallow_same::print_surfaces(),
        _ => {}
    }
    let mut h = Harness::from_arguments();
    sweeps::run(&mut h);
    snow::run(&mut h);
    speed::run(&mut h);
    bytes::run(&mut h);
    readers::run(&mut h);
    grains::run(&mut h);
    plates::run(&mut h);
    mist::run(&mut h);
    mist_rates::run(&mut h);
    mist_eddies::run(&mut h);
    mist_walls::run(&mut h);
    mist_passes::run(&mut h);
    mist_cancel::run(&mut h);
    shot::run(&mut h);
    volumes::run(&mut h);
    capi::run(&mut h);
    cancel::run(&mut h);
    reliability_guard_page::run(&mut h);
    reliability_step_calls::run(&mut h);
    flip::run(&mut h);
    far::run(&mut h);
    band::run(&mut h);
    spin::run(&mut h);
    damage::run(&mut h);
    empty_frames::run(&mut h);
    surface::run(&mut h);
    early::run(&mut h);
    vortex::run(&mut h);
    surface_readers::run(&mut h);
    large::run(&mut h);
    spot::run(&mut h);
    splashsurf::run(&mut h);
    tracker_cancel::run(&mut h);
    repair::run(&mut h);
    reliability_soup::run(&mut h);
    rebuilt::run(&mut h);
    rebuilt_topology::run(&mut h);
    textures::run(&mut h);
    rebuilt_speed::run(&mut h);
    rebuilt_frames::run(&mut h);
    rebuilt_large::run(&mut h);
    matching::run(&mut h);
    shallow_core::run(&mut h);
    shallow_film::run(&mut h);
    shallow_delivery::run(&mut h);
    shallow_orifice::run(&mut h);
    shallow_huppert::run(&mut h);
    shallow_incline::run(&mut h);
    shallow_walls::run(&mut h);
    shallow_spread::run(&mut h);
    shallow_bowl::run(&mut h);
    shallow_energy::run(&mut h);
    shallow_lake::run(&mut h);
    shallow_lifts::run(&mut h);
    shallow_dam::run(&mut h);
    shallow_mass::run(&mut h);
    shallow_falls::run(&mut h);
    shallow_range::run(&mut h);
    shallow_scalars::run(&mut h);
    shallow_same::run(&mut h);
    shallow_speed::run(&mut h);
    shallow_sleeping::run(&mut h);
    shallow_detail::run(&mut h);
    shallow_flooded::run(&mut h);
    shallow_terrain::run(&mut h);
    shallow_state::run(&mut h);
    shallow_surface::run(&mut h);
    shallow_whole::run(&mut h);
    shallow_threads::run(&mut h);
    easing::run(&mut h);
    reliability_bugs::run(&mut h);
    reliability_gltf_valid::run(&mut h);
    orientation::run(&mut h);
    rest_kept::run(&mut h);
    detail_kept::run(&mut h);
    house::run(&mut h);
    h.finish();
}
