//! Flipbooks: a picture of each frame, or a GIF of all of them, from one camera in one light.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use frazil::io::{atomic, sequence::Pattern};
use frazil::render::{Camera, Gif, Light, Models, Palette, Size, delays};
use frazil::{Context, Error, Result};

use super::drawing::{Drawing, Look};
use super::in_order::in_order;
use super::sources::Sources;
use crate::cli::exit::{Failure, Phase};
use crate::cli::progress::FrameProgress;
use crate::cli::session::Session;

/// Most frames that are made at once: each holds its snow as triangles.
const MOST_AT_ONCE: usize = 4;
/// The colours of a GIF are chosen from pictures this much smaller along each edge.
const SMALLER: u32 = 4;

/// Where the pictures go.
pub enum Target {
    /// One picture.
    Picture(PathBuf),
    /// A picture a frame.
    Pictures(Pattern),
    /// All in one file.
    Gif(PathBuf),
}

/// A flipbook to be made.
pub struct Flipbook<'a> {
    /// How everything is drawn.
    pub look: &'a Look,
    /// The frames, ascending; a still has none.
    pub frames: Vec<Option<f64>>,
    /// Where they go.
    pub target: Target,
    /// Frames of the shot a second.
    pub fps: f64,
}

/// What all pictures have in common.
struct View {
    camera: Camera,
    light: Light,
    size: Size,
}

impl View {
    fn draw(&self, ctx: &Context, models: &Models) -> Result<frazil::render::Picture> {
        models.draw(ctx, &self.camera, &self.light, self.size)
    }
}

impl Flipbook<'_> {
    /// Makes it, several frames at once.
    pub fn make(&self, sources: Sources, session: &Session) -> std::result::Result<(), Failure> {
        let sources = Mutex::new(sources);
        let read = |frame: Option<f64>| {
            let mut sources = sources.lock().map_err(|_| Error::Internal("a frame was not read".into()))?;
            sources.read(&session.ctx, frame)
        };
        let probes = self.probes().into_iter().map(|frame| self.look.build(&session.ctx, read(frame)?));
        let probes: Vec<Drawing> = probes.collect::<Result<_>>().before()?;
        let view = self.view(&probes)?;
        if let Target::Picture(path) = &self.target {
            let models = &probes[0].models;
            return view.draw(&session.ctx, models).and_then(|picture| picture.write(path)).during();
        }
        let count = self.frames.len();
        let progress = Mutex::new(FrameProgress::new(&session.ctx, count, 0, session.is_quiet()));
        let begin = |place: usize| {
            session.ctx.check()?;
            read(self.frames[place])
        };
        let make = |parts| Ok(view.draw(&session.ctx, &self.look.build(&session.ctx, parts)?.models)?);
        let told = |place: usize| {
            if let Ok(mut progress) = progress.lock() {
                progress.finished("picture", self.frames[place].map_or(0, |frame| frame as i32));
            }
        };
        let at_once = session.ctx.pool().threads().min(MOST_AT_ONCE);
        match &self.target {
            Target::Gif(path) => {
                let palette = palette(&session.ctx, &view, &probes).during()?;
                drop(probes);
                let indices = |_, parts| make(parts).map(|picture| palette.indices(&picture));
                self.write_gif(path, view.size, &palette, |add| {
                    in_order(count, at_once, begin, indices, |place, indices| {
                        add(place, indices)?;
                        told(place);
                        Ok(())
                    })
                })
                .during()
            }
            Target::Pictures(pattern) => {
                drop(probes);
                let write = |place: usize, parts| {
                    let frame = self.frames[place].map_or(0, |frame| frame as i32);
                    make(parts)?.write(&pattern.path(frame))
                };
                in_order(count, at_once, begin, write, |place, ()| {
                    told(place);
                    Ok(())
                })
                .during()
            }
            Target::Picture(_) => Ok(()),
        }
    }

    /// The frames from which camera and colours are chosen: the first, the middle and the last.
    fn probes(&self) -> Vec<Option<f64>> {
        let mut places = vec![0, (self.frames.len() - 1) / 2, self.frames.len() - 1];
        places.dedup();
        places.into_iter().map(|place| self.frames[place]).collect()
    }

    fn view(&self, probes: &[Drawing]) -> std::result::Result<View, Failure> {
        if self.look.color.is_some() && probes.iter().all(|drawing| !drawing.has_points) {
            return Err(Failure::refused("--color is for points, and no file holds any"));
        }
        let boxes = probes.iter().filter_map(|drawing| drawing.models.bounds());
        let bounds = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let bounds = bounds.ok_or_else(|| {
            let hollow = probes.iter().find_map(|drawing| drawing.hollow.as_ref());
            Failure::refused(match hollow {
                Some(hollow) => format!("there is nothing to draw: {hollow}"),
                None => "there is nothing to draw: the files are empty".to_string(),
            })
        })?;
        let camera = self.look.camera(bounds);
        Ok(View { camera, light: self.look.light(&camera), size: self.look.size })
    }

    /// Writes a GIF; `frames` calls what it is given with the place and the colours of each frame in turn.
    fn write_gif(
        &self,
        path: &Path,
        size: Size,
        palette: &Palette,
        frames: impl FnOnce(&mut dyn FnMut(usize, Vec<u8>) -> Result<()>) -> Result<()>,
    ) -> Result<()> {
        let numbers: Vec<i32> =
            self.frames.iter().map(|frame| frame.map_or(0, |frame| frame as i32)).collect();
        let delays = delays(&numbers, self.fps);
        // What stops the frames is not an error of the file.
        let mut stopped = None;
        let written = atomic::write(path, |out| {
            let mut gif = Gif::new(out, size, palette)?;
            let mut add = |place: usize, indices: Vec<u8>| {
                gif.add(indices, delays[place]).map_err(|error| Error::io(path, "write", error))
            };
            match frames(&mut add) {
                Ok(()) => gif.finish(),
                Err(error) => {
                    stopped = Some(error);
                    Err(std::io::Error::other("stopped"))
                }
            }
        });
        stopped.map_or(written, Err)
    }
}

/// Colours for all frames, from small pictures of some.
fn palette(ctx: &Context, view: &View, probes: &[Drawing]) -> Result<Palette> {
    let edge = |pixels: u32| pixels.div_ceil(SMALLER);
    let size = Size { width: edge(view.size.width), height: edge(view.size.height) };
    let small = View { camera: view.camera, light: view.light, size };
    let pictures: Vec<_> =
        probes.iter().map(|drawing| small.draw(ctx, &drawing.models)).collect::<Result<_>>()?;
    Palette::of(ctx, &pictures)
}
