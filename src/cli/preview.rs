//! `frazil preview`: a picture of meshes, level sets and points.

use std::path::{Path, PathBuf};

use frazil::base::{DVec3, Points};
use frazil::motion::{Character, Play, is_gltf};
use frazil::render::{Camera, Cloud, Light, Model, Models, Size};
use frazil::{Context, Error, io};

use super::exit::{Failure, Phase};
use super::session::Session;
use super::{options, output};

/// Draw meshes, level sets and points into a PNG.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  frazil preview cache/base/base.0048.vdb boot.obj -o print.png --eye 1,1.5,2 --target 0,0,1\n  \
                  frazil preview hero.glb --clip walk --frame 12 -o pose.png\n  \
                  frazil preview grains.0001.vdb -o grains.png --color v"
)]
pub struct Args {
    /// .vdb (its first level set, else a fog volume, else points), a mesh, a character or points (.ply).
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The picture.
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// Attribute that gives points their colours, from dark blue to pale yellow over its values.
    #[arg(long, value_name = "NAME")]
    color: Option<String>,
    /// Clip that characters play [default: they are at rest, or play their only clip with --frame].
    #[arg(long, value_name = "NAME")]
    clip: Option<String>,
    /// Frame of a shot that begins at 1, where the clip begins too.
    #[arg(long, value_name = "N", value_parser = options::finite, allow_hyphen_values = true)]
    frame: Option<f64>,
    /// Frames a second of --frame.
    #[arg(long, value_name = "N", default_value = "24", value_parser = options::positive, requires = "frame")]
    fps: f64,
    /// Pixels.
    #[arg(long, default_value = "1280x720", value_parser = options::size)]
    size: Size,
    /// Where the camera is (m) [default: so that everything is seen].
    #[arg(long, value_name = "X,Y,Z", value_parser = options::triple, allow_hyphen_values = true, requires = "target")]
    eye: Option<DVec3>,
    /// What it looks at (m).
    #[arg(long, value_name = "X,Y,Z", value_parser = options::triple, allow_hyphen_values = true, requires = "eye")]
    target: Option<DVec3>,
    /// Vertical field of view (degrees).
    #[arg(long, default_value_t = 35.0, requires = "eye")]
    fov: f64,
    /// Azimuth and elevation of the sun (degrees) [default: beside the camera].
    #[arg(long, value_name = "AZ,EL", value_parser = sun, allow_hyphen_values = true)]
    sun: Option<(f64, f64)>,
}

fn sun(text: &str) -> Result<(f64, f64), String> {
    let (azimuth, elevation) = text.split_once(',').ok_or("give azimuth,elevation")?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("\"{text}\" is not a number"));
    let (azimuth, elevation) = (number(azimuth)?, number(elevation)?);
    if !(1.0..=90.0).contains(&elevation) || !azimuth.is_finite() {
        return Err("the elevation must be within 1 to 90 degrees".into());
    }
    Ok((azimuth, elevation))
}

/// Runs the command.
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    output::check_writable(&args.output).before()?;
    output::refuse_input(&args.output, args.files.iter().map(PathBuf::as_path)).before()?;
    if !(1.0..=170.0).contains(&args.fov) {
        return Err(Failure::refused(format!("--fov {} is not within 1 to 170 degrees", args.fov)));
    }
    let posed = args.clip.is_some() || args.frame.is_some();
    if posed && !args.files.iter().any(|path| is_gltf(path)) {
        return Err(Failure::refused("--clip and --frame are for .glb and .gltf files, and none is given"));
    }
    let (mut models, mut clouds) = (Vec::new(), Vec::new());
    for path in &args.files {
        match points(path).before()? {
            Some(points) => {
                let cloud = Cloud::new(&points, args.color.as_deref());
                clouds.push(cloud.map_err(|error| Error::file(path, error.to_string())).before()?);
            }
            None => models.push(model(path, &args, &session.ctx).before()?),
        }
    }
    if clouds.is_empty() && args.color.is_some() {
        return Err(Failure::refused("--color is for points, and no file holds any"));
    }
    let models = Models::new(models).with_clouds(clouds);
    let bounds =
        models.bounds().ok_or_else(|| Failure::refused("there is nothing to draw: the files are empty"))?;
    let mut camera = Camera::framing(bounds, args.size);
    if let (Some(eye), Some(target)) = (args.eye, args.target) {
        if eye == target {
            return Err(Failure::refused("--eye and --target are the same point"));
        }
        camera = Camera { eye, target, fov_deg: args.fov };
    }
    let light = match args.sun {
        Some((azimuth, elevation)) => Light::from_degrees(azimuth, elevation),
        None => Light::beside(&camera),
    };
    let picture = models.draw(&session.ctx, &camera, &light, args.size).during()?;
    picture.write(&args.output).during()
}

/// The points of a file, if that is what it is drawn as.
fn points(path: &Path) -> frazil::Result<Option<Points>> {
    match io::mesh::extension(path).as_str() {
        #[cfg(feature = "vdb")]
        "vdb" => super::vdb::model::points_of(path),
        "ply" if io::points_ply::holds_points(path)? => {
            let cloud = io::points_ply::read(path)?;
            let voxel = cloud.voxel_size.unwrap_or(0.01);
            cloud.into_points(Some(voxel)).map(Some).map_err(|error| Error::file(path, error.to_string()))
        }
        _ => Ok(None),
    }
}

#[cfg_attr(not(feature = "vdb"), expect(unused_variables, reason = "meshes of grids are made by threads"))]
fn model(path: &Path, args: &Args, ctx: &Context) -> frazil::Result<Model> {
    let mesh = match io::mesh::extension(path).as_str() {
        #[cfg(feature = "vdb")]
        "vdb" => return super::vdb::model::of_file(path, ctx),
        #[cfg(not(feature = "vdb"))]
        "vdb" => return super::needs_openvdb(path),
        _ if is_gltf(path) && args.clip.is_none() && args.frame.is_none() => Character::at_rest(path)?,
        _ if is_gltf(path) => {
            let play = Play { clip: args.clip.clone(), ..Play::default() };
            Character::posed(path, play, (args.frame.unwrap_or(1.0) - 1.0) / args.fps)?
        }
        _ => io::mesh::read(path)?.without_unused(),
    };
    Ok(Model::mesh(&mesh, [0.35, 0.16, 0.08]))
}
