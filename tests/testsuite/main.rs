//! All tests that use the library, in one program; its folders are the rooms of `src/`. Tests run as threads of one process:
//! those that cannot are in `tests/alone`. What reads our files with other libraries is in `tests/readers.rs`, which does not
//! link ours.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/picture.rs"]
mod picture;
#[path = "../common/program.rs"]
mod program;

mod geometry {
    mod faults;
    mod meshes;
    mod orientation;
    mod weld;
}
mod capi {
    mod header;
}
mod cli {
    mod compare;
    mod errors;
    mod examples;
    mod figures;
    mod flipbook;
    mod forecasts;
    mod honest;
    mod limits;
    mod linear;
    mod origin;
    mod outputs;
    mod points;
    mod repair;
    mod runs;
    mod shallow;
    mod side_by_side;
    mod soup;
    mod speed;
    mod stages;
    mod takes;
    mod tools;
    mod words;
}
mod flow {
    mod advection;
    mod fields;
    mod pressure;
    mod walls;
}
mod house {
    mod circles;
    mod defaults;
    mod gates;
    mod imports;
    mod readers;
    mod tracked;
}
mod io {
    mod arrays;
    mod damage;
    mod files;
    mod particles;
    mod particles_damage;
    mod text_variants;
    mod usd;
    mod uvs;
}
mod motion {
    mod gltf;
    mod gltf_extensions;
}
mod render {
    mod cut;
    mod fog;
    mod linear;
    mod points;
    mod preview;
}
mod scene {
    mod clients;
    mod costs;
    mod demo_jelly;
    mod demo_walk;
    mod farm;
    mod fuzz;
    mod shallow_carried;
    mod shallow_follows;
    mod shallow_shot;
    mod shallow_usd;
    mod shallow_volume;
    mod shot_defaults;
    mod shot_folder;
    mod shot_grain_files;
    mod shot_grain_inputs;
    mod shot_grains;
    mod shot_inputs;
    mod shot_mist;
    mod shot_runs;
    mod shot_upstream;
    mod shot_volumes;
}
mod snow {
    mod base;
    mod behind_ground;
    mod crumbs;
    mod grain_limits;
    mod grain_options;
    mod grain_slopes;
    mod grains;
    mod holes;
    mod layers;
    mod mist;
    mod state;
    mod volumes;
}
mod shallow {
    mod balance;
    mod border;
    mod detail;
    mod detail_ground;
    mod detail_scalars;
    mod detail_state;
    mod detail_surface;
    mod falls;
    mod falls_scalars;
    mod falls_threads;
    mod flooded;
    mod flow;
    mod frames;
    mod loads;
    mod moving;
    mod probe;
    mod scalars;
    mod sleeping;
    mod stains;
    mod state;
    mod surface;
    mod surface_groups;
    mod surface_lifts;
    mod surface_mesh;
    mod surface_skirts;
    mod terrain;
    mod thickening;
    mod threads;
    mod walls;
}
mod surface {
    mod command;
    mod easing;
    mod empty_frames;
    mod from_particles;
    mod implicit;
    mod made_sets;
    mod passing;
    mod rebuilt;
    mod repair;
    mod resculpt;
    mod shot;
    mod small;
    mod thin_sheets;
    mod tracking;
    mod usd;
}
mod sweep {
    mod band;
    mod chain;
    mod folds;
    mod methods;
    mod soup;
    mod window;
}
mod vdb {
    mod points;
    mod tools;
}
