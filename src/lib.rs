//! A volumetric toolkit for visual effects and real-time simulation, on OpenVDB: snow that characters press their prints into,
//! surfaces of liquids, and small liquids in real time.
//!
//! Lengths are metres, times seconds, Y is up. The output is the same, byte for byte, with any number of threads.
//!
//! # Where to begin
//!
//! | to | use |
//! |---|---|
//! | run a shot from a scene file into a folder, as `frazil snow` does | [`scene::Scene`], [`scene::snow::pipeline`], [`scene::run::Run`] |
//! | press moving meshes into snow in a frame loop of your own | [`snow::base_layer::BaseLayer`] |
//! | turn the volume that moving meshes sweep into a level set | [`sweep::chain()`] |
//! | let mist, or a gas or liquid of your own, flow around obstacles | [`snow::mist`], [`flow`] |
//! | move things: rigid keys, sequences of meshes, glTF characters | [`motion`] |
//! | make, change, measure and save level sets | [`vdb::level_set`], [`vdb::file`] |
//! | read and write meshes, as polygons with UVs | [`io::mesh`] |
//! | read particle caches of other programs | [`io::particles`] |
//! | make the surface of a liquid from its particles; let a detailed mesh follow them | [`surface`] |
//! | let a little liquid flow over a terrain in real time | [`shallow`] |
//! | render previews | [`render`] |
//! | link from C or C++ | `include/frazil.h`, generated from [`capi`] |
//!
//! Everything that takes a long time takes a [`Context`]: threads, cancel, progress and the times of its phases.
//!
//! # A step of snow
//!
//! ```
//! # #[cfg(feature = "vdb")]
//! # fn main() -> frazil::Result<()> {
//! use frazil::geometry::{DVec3, TriMesh};
//! use frazil::motion::{Key, Keys, Rigid};
//! use frazil::snow::base_layer::{BaseLayer, Params, initial};
//! use frazil::sweep::Body;
//! use frazil::{Context, Pool};
//!
//! let ctx = Context::new(Pool::all_cores()?);
//! let cell = 0.02;
//! let ground = initial::Ground::Plane { height: 0.0, area: [-0.5, -0.5, 0.5, 0.5] };
//! let snow = initial::layer(&ctx, &ground, &[], &initial::Cover::Depth(0.3), cell, 3.0)?;
//! let mut base = BaseLayer::new(&ctx, snow, Params { noise: None, ..Params::for_cell(cell) })?;
//!
//! // A box of 0.2 m slides through the snow by 0.4 m, 0.1 m deep.
//! let key = |time, z| Key { time, at: DVec3::new(0.0, 0.3, z), turn: DVec3::zeros() };
//! let slide = Keys::new(vec![key(0.0, -0.2), key(1.0, 0.2)])?;
//! let body = Body::new(Box::new(Rigid::new(TriMesh::cuboid([-0.1; 3], [0.1; 3]), slide)), 0.0)?;
//! let report = base.step(&ctx, &[body], 0.0, 1.0, 1)?;
//! assert!((report.removed_volume - 0.1 * 0.2 * 0.6).abs() < 0.0005);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "vdb"))]
//! # fn main() {}
//! ```
//!
//! # A shot
//!
//! ```
//! # #[cfg(all(feature = "vdb", feature = "scene"))]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use frazil::scene::{Inputs, Scene, run::Run, snow};
//! use frazil::{Context, Pool, io};
//!
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path();
//! io::mesh::write(&folder.join("box.ply"), &frazil::geometry::TriMesh::cuboid([-0.1; 3], [0.1; 3]))?;
//! let text = r#"
//! [shot]
//! frames = "1-3"
//! [snow]
//! ground = 0
//! area = [-0.5, -0.5, 0.5, 0.5]
//! depth = 0.3
//! cell = 0.04
//! [[object]]
//! file = "box.ply"
//! keys = [{ frame = 1, at = [0, 0.3, -0.2] }, { frame = 3, at = [0, 0.3, 0.2] }]
//! "#;
//! let scene = Scene::parse(text, &folder.join("shot.toml"), &[])?;
//! let inputs = Inputs::load(&scene)?;
//! let pipeline = snow::pipeline(&scene, &inputs);
//! let ctx = Context::new(Pool::all_cores()?);
//! let run = Run::prepare(&ctx, &pipeline, &folder.join("cache"), &[], &scene.shot().frames.into(), None)?;
//! run.make(&ctx, |done| log::info!("{} {}: {:?}", done.stage, done.frame, done.report.results))?;
//! assert!(folder.join("cache/base/base.0003.vdb").exists());
//! # Ok(())
//! # }
//! # #[cfg(not(all(feature = "vdb", feature = "scene")))]
//! # fn main() {}
//! ```
//!
//! # Features
//!
//! `vdb` (OpenVDB), `scene` (scene files and the frame loop) and `cli` (the command, pictures); without any of them the crate
//! is pure Rust. Rooms are layered, a room uses only those below it: see `CONTRIBUTING.md`.

pub mod capi;
pub mod context;
pub mod distance;
pub mod error;
pub mod flow;
pub mod geometry;
pub mod io;
pub mod mesh_repair;
pub mod motion;
pub mod numeric;
#[cfg(feature = "cli")]
pub mod render;
#[cfg(feature = "scene")]
pub mod scene;
pub mod shallow;
pub mod snow;
pub mod surface;
pub mod sweep;
#[cfg(feature = "vdb")]
pub mod vdb;

pub use context::{Context, Pool};
pub use error::{Error, Result};

/// The README's example.
#[cfg(all(doctest, feature = "vdb"))]
#[doc = include_str!("../README.md")]
struct Readme;
