//! Every promise with a number: `make gates [ONLY=prefix,...]`.

mod capi;
#[path = "../../tests/common/mod.rs"]
mod common;
mod files;
#[path = "harness.rs"]
mod harness;
mod house;
mod plots;
mod reliability;
mod scenes;
mod shallow;
mod snow;
mod surface;
mod sweep;
mod worst;

use harness::Harness;

fn main() {
    let first = std::env::args().nth(1);
    match first.as_deref() {
        Some(snow::speed::PEAK) => return snow::speed::print_peak(),
        Some(snow::bytes::HASH) => return snow::bytes::print_hash(),
        Some(snow::grains::memory::MEMORY) => return snow::grains::memory::print_memory(),
        Some(snow::mist::MEMORY) => return snow::mist::print_memory(),
        Some(surface::rebuilt_large::MILLION) => return surface::rebuilt_large::print_million(),
        Some(files::damage::FUZZ) => return files::damage::read_mutated(),
        Some(shallow::same_bytes::HASH) => return shallow::same_bytes::print_hash(),
        Some(shallow::same_bytes::SURFACES) => return shallow::same_bytes::print_surfaces(),
        _ => {}
    }
    let mut h = Harness::from_arguments();
    sweep::walls::run(&mut h);
    snow::base_layer::run(&mut h);
    snow::speed::run(&mut h);
    snow::bytes::run(&mut h);
    files::readers::run(&mut h);
    snow::grains::run(&mut h);
    snow::plates::run(&mut h);
    snow::mist::run(&mut h);
    snow::mist::frame_rate::run(&mut h);
    snow::mist::eddies::run(&mut h);
    snow::mist::walls::run(&mut h);
    snow::mist::passes::run(&mut h);
    snow::mist::cancel::run(&mut h);
    snow::shot::run(&mut h);
    snow::volumes::run(&mut h);
    capi::calls::run(&mut h);
    capi::cancel::run(&mut h);
    reliability::guard_page::run(&mut h);
    reliability::step_calls::run(&mut h);
    snow::damaged_folder::run(&mut h);
    snow::far::run(&mut h);
    sweep::band::run(&mut h);
    sweep::spin::run(&mut h);
    files::damage::run(&mut h);
    reliability::empty_frames::run(&mut h);
    surface::known_motion::run(&mut h);
    surface::first_flag::run(&mut h);
    surface::vortex::run(&mut h);
    surface::readers::run(&mut h);
    surface::large::run(&mut h);
    surface::spot::run(&mut h);
    surface::splashsurf::run(&mut h);
    surface::cancel::run(&mut h);
    surface::repair::run(&mut h);
    reliability::soup::run(&mut h);
    surface::rebuilt::run(&mut h);
    surface::rebuilt_topology::run(&mut h);
    surface::textures::run(&mut h);
    surface::rebuilt_speed::run(&mut h);
    surface::rebuilt_frames::run(&mut h);
    surface::rebuilt_large::run(&mut h);
    surface::matching::run(&mut h);
    shallow::core::run(&mut h);
    shallow::film::run(&mut h);
    shallow::delivery::run(&mut h);
    shallow::orifice::run(&mut h);
    shallow::huppert::run(&mut h);
    shallow::incline::run(&mut h);
    shallow::walls::run(&mut h);
    shallow::spread::run(&mut h);
    shallow::bowl::run(&mut h);
    shallow::energy::run(&mut h);
    shallow::lake::run(&mut h);
    shallow::minimum_heights::run(&mut h);
    shallow::dam::run(&mut h);
    shallow::mass::run(&mut h);
    shallow::free_fall::run(&mut h);
    shallow::range::run(&mut h);
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
    surface::easing::run(&mut h);
    reliability::bugs::run(&mut h);
    reliability::gltf_valid::run(&mut h);
    reliability::orientation::run(&mut h);
    surface::rest_kept::run(&mut h);
    surface::detail_kept::run(&mut h);
    house::run(&mut h);
    h.finish();
}
