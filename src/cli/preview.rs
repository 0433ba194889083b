//! `frazil preview`: a picture of meshes and level sets.

use std::path::{Path, PathBuf};

use frazil::base::DVec3;
use frazil::motion::Character;
use frazil::render::{Camera, Light, Model, Size, Stage};
use frazil::vdb::file;
use frazil::{Context, io};

use super::exit::{Failure, Phase};
use super::session::Session;
use super::{options, output};

/// Draw meshes and level sets into a PNG.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  frazil preview cache/base/base.0048.vdb boot.obj -o print.png --eye 1,1.5,2 --target 0,0,1"
)]
pub struct Args {
    /// .vdb (its first level set), a mesh or a character at rest.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The picture.
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
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
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("\"{text}\" is no number"));
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
    let models =
        args.files.iter().map(|path| model(path, &session.ctx)).collect::<frazil::Result<Vec<Model>>>();
    let stage = Stage::new(models.before()?);
    let bounds =
        stage.bounds().ok_or_else(|| Failure::refused("there is nothing to draw: the files are empty"))?;
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
    let picture = stage.draw(&session.ctx, &camera, &light, args.size).during()?;
    picture.write(&args.output).during()
}

fn model(path: &Path, ctx: &Context) -> frazil::Result<Model> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let mesh = match extension.as_str() {
        "vdb" => return Model::level_set(ctx, &file::read_named(path, None)?),
        "glb" | "gltf" => Character::at_rest(path)?,
        _ => io::mesh::read(path)?,
    };
    Ok(Model::mesh(&mesh, [0.35, 0.16, 0.08]))
}
