//! Every promise with a number: `make gates [ONLY=prefix,...]`.

mod bins;
mod capi;
#[path = "../../tests/common/mod.rs"]
mod common;
#[path = "harness.rs"]
mod harness;
mod house;
mod packages;
mod plots;
mod process;
mod reliability;
mod scenes;
mod shallow;
mod shots;
mod snow;
mod surface;
mod sweep;
mod worst;

use harness::Harness;

/// What runs of this program do for a word; others measure them.
const RUNS: [(&str, fn()); 8] = [
    ("peak-of-large", snow::speed::print_peak),
    ("hash-of-small", snow::bytes::print_hash),
    ("memory-of-grains", snow::grains::memory::print_memory),
    ("memory-of-mist", snow::mist::print_memory),
    ("rebuilt-million", surface::rebuilt_large::print_million),
    ("read-mutated", reliability::damage::read_mutated),
    ("hash-of-shallow", shallow::same_bytes::print_hash),
    ("hash-of-surfaces", shallow::same_bytes::print_surfaces),
];

fn main() {
    if let Some((_, run)) = RUNS.iter().find(|(word, _)| std::env::args().nth(1).as_deref() == Some(word)) {
        return run();
    }
    let mut h = Harness::from_arguments();
    sweep::walls::run(&mut h);
    snow::base_layer::run(&mut h);
    snow::speed::run(&mut h);
    snow::bytes::run(&mut h);
    snow::grains::run(&mut h);
    h.measure("snow.base.plates", snow::plates::measure);
    snow::mist::run(&mut h);
    h.measure("snow.mist.frame_rate", snow::mist::frame_rate::measure);
    h.measure("snow.mist.turbulence_decorrelates", snow::mist::eddies::measure);
    snow::mist::walls::run(&mut h);
    snow::mist::jets::run(&mut h);
    snow::mist::passes::run(&mut h);
    h.measure("snow.mist.cancel_p99", snow::mist::cancel::measure);
    snow::shot::run(&mut h);
    snow::volumes::run(&mut h);
    capi::calls::run(&mut h);
    h.measure_all(["reliability.cancel_reset", "reliability.cancel_reset_changed"], capi::cancel::measure);
    reliability::step_calls::run(&mut h);
    h.measure_all(["reliability.flip_wrong", "reliability.flip_unnamed"], snow::damaged_folder::measure);
    snow::far::run(&mut h);
    let names = ["reliability.band_jumps", "reliability.band_snow", "reliability.band_error"];
    h.measure_all(names, sweep::band::measure);
    sweep::spin::run(&mut h);
    reliability::damage::run(&mut h);
    h.measure("reliability.gltf_valid", reliability::gltf_valid::measure);
    h.measure("reliability.guard_page", reliability::guard_page::measure);
    h.measure("reliability.empty_frames", reliability::empty_frames::measure);
    surface::known_motion::run(&mut h);
    h.measure("surface.flag_delay", surface::first_flag::measure);
    surface::vortex::run(&mut h);
    surface::readers::run(&mut h);
    surface::large::run(&mut h);
    surface::spot::run(&mut h);
    surface::splashsurf::run(&mut h);
    surface::cancel::run(&mut h);
    surface::repair::run(&mut h);
    h.measure_all(["reliability.soup_silent", "reliability.soup_warned"], reliability::soup::measure);
    surface::rebuilt::run(&mut h);
    surface::rebuilt_topology::run(&mut h);
    h.measure("surface.textures", surface::textures::measure);
    surface::rebuilt_speed::run(&mut h);
    surface::rebuilt_frames::run(&mut h);
    surface::rebuilt_large::run(&mut h);
    h.measure_all(["surface.match_near", "surface.match_neck"], surface::matching::measure);
    shallow::core::run(&mut h);
    shallow::film::run(&mut h);
    h.measure("shallow.delivery", shallow::delivery::measure);
    h.measure("shallow.orifice", shallow::orifice::measure);
    let names = ["exponent", "exponent_coarse", "front", "front_coarse"]
        .map(|name| format!("shallow.huppert_{name}"));
    h.measure_all(names, shallow::huppert::measure);
    shallow::incline::run(&mut h);
    shallow::walls::run(&mut h);
    h.measure_all(["shallow.spread_exponent", "shallow.spread_round"], shallow::spread::measure);
    h.measure("shallow.bowl_period", shallow::bowl::measure);
    let names = ["shallow.energy_start", "shallow.energy_high", "shallow.energy_viscous"];
    h.measure_all(names, shallow::energy::measure);
    shallow::lake::run(&mut h);
    shallow::minimum_heights::run(&mut h);
    h.measure_all(["shallow.dam_front", "shallow.dam_depth"], shallow::dam::measure);
    h.measure("shallow.mass", shallow::mass::measure);
    shallow::free_fall::run(&mut h);
    h.measure("shallow.depth_range", shallow::range::measure);
    shallow::scalars::run(&mut h);
    shallow::same_bytes::run(&mut h);
    shallow::speed::run(&mut h);
    shallow::sleeping::run(&mut h);
    shallow::two_level::run(&mut h);
    shallow::flooded::run(&mut h);
    shallow::terrain::run(&mut h);
    shallow::state::run(&mut h);
    shallow::surface::run(&mut h);
    shallow::whole::run(&mut h);
    shallow::threads::run(&mut h);
    let names = ["surface.easing_jump", "surface.easing_depth", "surface.easing_volume"];
    h.measure_all(names, surface::easing::measure);
    reliability::bugs::run(&mut h);
    let names = ["silent", "decidable", "correct"].map(|name| format!("reliability.orientation_{name}"));
    h.measure_all(names, reliability::orientation::measure);
    surface::rest_kept::run(&mut h);
    surface::detail_kept::run(&mut h);
    h.measure("house.circles", house::circles);
    shots::run(&mut h);
    packages::run(&mut h);
    h.finish();
}
