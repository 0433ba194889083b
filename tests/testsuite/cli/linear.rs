//! `preview -o X.exr`: pictures for compositing, read by the crate that writes them.

use std::fs;
use std::path::Path;

use exr::prelude::{FlatSamples, read_first_flat_layer_from_file};

use crate::picture::Picture;
use crate::program::{CUBE, Folder, fails, works};

const VIEW: &str = "--size 96x64 --eye 0,0.2,2 --target 0,0.2,0 --fov 30 -q";

/// An EXR file: its size, and the channels by name with their values; all but Z have 16 bits.
struct Channels {
    size: [usize; 2],
    channels: Vec<(String, Vec<f32>)>,
}

impl Channels {
    #[track_caller]
    fn open(path: &Path) -> Self {
        let layer = read_first_flat_layer_from_file(path).unwrap().layer_data;
        let channel = |channel: &exr::prelude::AnyChannel<FlatSamples>| {
            let name = channel.name.to_string();
            assert_eq!(matches!(channel.sample_data, FlatSamples::F32(_)), name == "Z", "{name}");
            (name, channel.sample_data.values_as_f32().collect())
        };
        let channels = layer.channel_data.list.iter().map(channel).collect();
        Self { size: [layer.size.0, layer.size.1], channels }
    }

    fn at(&self, name: &str, [x, y]: [usize; 2]) -> f32 {
        let channel = self.channels.iter().find(|(of, _)| of == name).unwrap();
        channel.1[y * self.size[0] + x]
    }
}

#[test]
fn an_exr_has_linear_light_opacity_and_depth() {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    for (name, threads) in [("a.exr", 1), ("b.EXR", 3)] {
        works(&folder, &format!("preview cube.obj -o {name} {VIEW} --threads {threads}"));
    }
    assert!(fs::read(folder.join("a.exr")).unwrap() == fs::read(folder.join("b.EXR")).unwrap());
    works(&folder, &format!("preview cube.obj -o a.png {VIEW}"));
    let (exr, png) = (Channels::open(&folder.join("a.exr")), Picture::open(&folder.join("a.png")));
    let names: Vec<&str> = exr.channels.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!((exr.size, names), ([96, 64], vec!["A", "B", "G", "R", "Z"]));
    // The front of the cube, at z = 0.2, also away from the middle; the sky.
    for pixel in [[48, 32], [40, 26]] {
        assert_eq!(exr.at("A", pixel), 1.0);
        assert!((exr.at("Z", pixel) - 1.8).abs() < 1e-5, "{}", exr.at("Z", pixel));
        // Dark enough for what is shown to be the light times 0.92, in the code of sRGB.
        for (channel, name) in ["R", "G", "B"].iter().enumerate() {
            let coded = f64::from(png.pixel(pixel[0], pixel[1])[channel]) / 255.0;
            let shown = if coded <= 0.04045 { coded / 12.92 } else { ((coded + 0.055) / 1.055).powf(2.4) };
            assert!(
                shown < 0.6 && (f64::from(exr.at(name, pixel)) * 0.92 - shown).abs() < 0.004,
                "{name} {shown}"
            );
        }
    }
    assert_eq!(
        ["R", "G", "B", "A", "Z"].map(|name| exr.at(name, [2, 2])),
        [0.0, 0.0, 0.0, 0.0, f32::INFINITY]
    );
    let partly = exr.channels[0].1.iter().filter(|alpha| **alpha > 0.0 && **alpha < 1.0).count();
    assert!(partly > 20, "edges are smooth: {partly}");
}

#[test]
fn frames_of_a_shot_are_numbered_exr_files() {
    let folder = &Folder::empty();
    for frame in 1..=3 {
        let moved = CUBE.replace("v -.2 0", &format!("v -.{frame} 0"));
        fs::write(folder.join(format!("cube.000{frame}.obj")), moved).unwrap();
    }
    works(folder, &format!("preview cube.%04d.obj --frames 1-3x2 -o p.%04d.exr {VIEW}"));
    assert!(!folder.join("p.0002.exr").exists());
    for frame in [1, 3] {
        works(folder, &format!("preview cube.000{frame}.obj -o still.exr {VIEW}"));
        assert!(
            fs::read(folder.join(format!("p.000{frame}.exr"))).unwrap()
                == fs::read(folder.join("still.exr")).unwrap()
        );
    }
    assert!(fs::read(folder.join("p.0001.exr")).unwrap() != fs::read(folder.join("p.0003.exr")).unwrap());
    fails(
        folder,
        "preview cube.%04d.obj --frames 1-3 -o p.exr",
        2,
        &["p.exr", "several frames need a pattern"],
    );
    fails(folder, "preview cube.0001.obj --cut x=0 -o cut.exr", 2, &["cut.exr", "--cut", ".png"]);
    let big = "preview cube.0001.obj -o big.exr --size 1000x1000 --max-memory 40M";
    fails(folder, big, 2, &["a picture for compositing", "44 MB"]);
    fails(folder, "preview cube.0001.obj -o p.tif", 2, &["p.tif", ".png", ".exr", ".gif"]);
}
