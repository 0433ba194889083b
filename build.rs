//! Builds the C++ side of the bridge to OpenVDB (feature `vdb`).

use std::path::{Path, PathBuf};

/// Sources, those of a group compiled as one: each compilation reads OpenVDB's headers and makes the functions of its trees
/// anew, which takes longer than most of our own. Two groups of about the same time, for two cores; what a group's sources
/// call their own (`namespace {`) needs different names.
const SOURCES: [&[&str]; 2] =
    [&["grid.cc", "file.cc", "parts.cc", "csg.cc", "filters.cc", "particles.cc"], &["meshing.cc"]];

fn main() {
    println!("cargo:rerun-if-env-changed=OPENVDB_ROOT");
    println!("cargo:rerun-if-env-changed=TBB_ROOT");
    if std::env::var_os("CARGO_FEATURE_VDB").is_none() {
        return;
    }
    let roots: Vec<PathBuf> =
        ["OPENVDB_ROOT", "TBB_ROOT"].iter().filter_map(std::env::var_os).map(PathBuf::from).collect();
    let has_header = |root: &Path| root.join("include/openvdb/openvdb.h").exists();
    if !roots.iter().any(|root| has_header(root))
        && !has_header(Path::new("/usr"))
        && !has_header(Path::new("/usr/local"))
    {
        eprintln!(
            "OpenVDB's headers were not found: apt-get install libopenvdb-dev libboost-dev libboost-iostreams-dev,"
        );
        eprintln!(
            "or set OPENVDB_ROOT to the folder that holds include/openvdb; or build with --no-default-features."
        );
        std::process::exit(1);
    }
    let mut build = cxx_build::bridge("src/vdb/bridge.rs");
    build
        .std("c++17")
        .opt_level(3)
        .debug(false)
        .define("NDEBUG", None)
        .define("IMATH_HALF_NO_LOOKUP_TABLE", None)
        // The same bits on every machine: the compiler may not fuse multiply and add.
        .flag("-ffp-contract=off")
        .include("cpp")
        .warnings(true);
    for root in &roots {
        build.flag("-isystem").flag(root.join("include").display().to_string());
        for folder in ["lib", "lib64"] {
            println!("cargo:rustc-link-search=native={}", root.join(folder).display());
        }
    }
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    for group in SOURCES {
        let joined = out.join(format!("with_{}", group[0]));
        let text: String = group.iter().map(|source| format!("#include \"{source}\"\n")).collect();
        std::fs::write(&joined, text).expect("cargo's folder can be written to");
        build.file(joined);
        for source in group {
            println!("cargo:rerun-if-changed=cpp/{source}");
        }
    }
    println!("cargo:rerun-if-changed=cpp/bridge.h");
    println!("cargo:rerun-if-changed=cpp/impl.h");
    println!("cargo:rerun-if-changed=src/vdb/bridge.rs");
    build.compile("frazil_openvdb");
    println!("cargo:rustc-link-lib=openvdb");
    println!("cargo:rustc-link-lib=tbb");
}
