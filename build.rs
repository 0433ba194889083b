//! Builds the C++ side of the bridge to OpenVDB (feature `vdb`).

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sources; each group is one translation unit, because parsing OpenVDB's headers and instantiating its trees takes longer
/// than most of our own code. Two groups that take about the same time, for two cores. The sources of a group share their
/// anonymous namespaces, so names in these must differ.
const SOURCES: [&[&str]; 2] =
    [&["grid.cc", "parts.cc", "csg.cc", "filters.cc", "particles.cc"], &["meshing.cc", "points.cc"]];

/// The macro with which the functions of OpenVDB's trees come from its library and are not instantiated here.
const TREES: &str = "FRAZIL_TREES_OF_LIBRARY";

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
    for root in &roots {
        for folder in ["lib", "lib64"] {
            println!("cargo:rustc-link-search=native={}", root.join(folder).display());
        }
    }
    for source in SOURCES.concat().into_iter().chain(LOOPS) {
        println!("cargo:rerun-if-changed=cpp/{source}");
    }
    println!("cargo:rerun-if-changed=cpp/bridge.h");
    println!("cargo:rerun-if-changed=cpp/impl.h");
    println!("cargo:rerun-if-changed=src/vdb/bridge.rs");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    let archive = out.join(format!("lib{ARCHIVE}.a"));
    let of_library = library(&roots).and_then(|library| symbols(&["-D", "--defined-only"], &library));
    let bridge = cxx_build::bridge("src/vdb/bridge.rs");
    std::thread::scope(|scope| {
        scope.spawn(|| compile_loops(&roots, &out));
        let is_compiled = of_library.is_some_and(|mut defined| {
            compile(bridge.clone(), &roots, &out, Some(TREES));
            defined.extend(symbols(&["--defined-only"], &archive).unwrap_or_default());
            // A library of another distribution may lack some symbols.
            symbols(&["--undefined-only"], &archive).is_some_and(|needed| needed.is_subset(&defined))
        });
        if !is_compiled {
            compile(bridge, &roots, &out, None);
        }
    });
    println!("cargo:rustc-link-lib=openvdb");
    println!("cargo:rustc-link-lib=tbb");
}

/// Sources with loops over voxels and positions, compiled for speed, with their own instances of OpenVDB's trees: the
/// library's write files a tenth slower.
const LOOPS: [&str; 2] = ["file.cc", "sample.cc"];
/// Name of the static library of [`SOURCES`].
const ARCHIVE: &str = "frazil_openvdb";

/// Compiles the bridge and its sources, with a macro defined.
fn compile(mut build: cc::Build, roots: &[PathBuf], out: &Path, defined: Option<&str>) {
    // Compiles in half the time of level 3, and runs as fast where the time is spent in OpenVDB's library.
    configure(&mut build, roots).opt_level(1);
    defined.iter().for_each(|name| {
        build.define(name, None);
    });
    for group in SOURCES {
        build.file(joined(out, group));
    }
    build.compile(ARCHIVE);
}

/// Compiles [`LOOPS`].
fn compile_loops(roots: &[PathBuf], out: &Path) {
    let mut build = cc::Build::new();
    configure(build.cpp(true), roots).opt_level(3);
    build.include(out.join("cxxbridge/include")).include(out.join("cxxbridge/crate"));
    build.file(joined(out, &LOOPS)).compile("frazil_openvdb_loops");
}

/// A file that includes some sources.
fn joined(out: &Path, sources: &[&str]) -> PathBuf {
    let path = out.join(format!("with_{}", sources[0]));
    let text: String = sources.iter().map(|source| format!("#include \"{source}\"\n")).collect();
    std::fs::write(&path, text).expect("cargo's folder can be written to");
    path
}

/// Sets the options that all sources share.
fn configure<'b>(build: &'b mut cc::Build, roots: &[PathBuf]) -> &'b mut cc::Build {
    build
        .std("c++17")
        .debug(false)
        .define("NDEBUG", None)
        .define("IMATH_HALF_NO_LOOKUP_TABLE", None)
        // The same bits on every machine: the compiler may not fuse multiply and add.
        .flag("-ffp-contract=off")
        .include("cpp")
        .warnings(true);
    for root in roots {
        build.flag("-isystem").flag(root.join("include").display().to_string());
    }
    build
}

/// OpenVDB's shared library, as the linker will find it.
fn library(roots: &[PathBuf]) -> Option<PathBuf> {
    let system = ["/usr/lib/x86_64-linux-gnu", "/usr/lib64", "/usr/lib", "/usr/local/lib"].map(PathBuf::from);
    let own = roots.iter().flat_map(|root| ["lib", "lib64"].map(|folder| root.join(folder)));
    own.chain(system).map(|folder| folder.join("libopenvdb.so")).find(|path| path.exists())
}

/// OpenVDB's names in an object file, as `nm` lists them.
fn symbols(options: &[&str], file: &Path) -> Option<HashSet<String>> {
    let listed =
        Command::new("nm").args(options).arg(file).output().ok().filter(|listed| listed.status.success())?;
    let text = String::from_utf8(listed.stdout).ok()?;
    let names = text.lines().filter_map(|line| line.split_whitespace().last());
    // Symbols of this crate may have OpenVDB's types in their names.
    Some(
        names
            .filter(|name| name.contains("openvdb") && !name.contains("frazil"))
            .map(str::to_string)
            .collect(),
    )
}
