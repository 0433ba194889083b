//! Flipbooks: a picture of each frame, or a GIF of all of them, from one camera in one light.

use std::path::Path;

use frazil::io::{atomic, sequence::Pattern};
use frazil::render::{Gif, Palette, Picture, delays};
use frazil::{Error, Result};

use super::drawing::{Drawing, Look, View};
use super::in_order::in_order;
use super::sources::Sources;
use crate::cli::exit::{Failure, Phase};
use crate::cli::progress::FrameProgress;
use crate::cli::session::Session;

/// Most frames that are made at once: each holds its snow as triangles, and a limit of memory holds for each of them.
const MOST_AT_ONCE: usize = 4;
/// The colours of a GIF are chosen from pictures that are smaller by this factor along each edge.
const SMALLER: u32 = 4;

/// Frames that are drawn by one camera.
pub struct Flipbook<'a> {
    session: &'a Session,
    look: &'a Look,
    sources: Sources,
    /// Ascending.
    frames: Vec<i32>,
    view: View,
    /// The first frame, one in the middle and the last.
    probes: Vec<Drawing>,
}

impl<'a> Flipbook<'a> {
    /// Chooses the camera for some frames, ascending, at least one: it sees all of the first, of one in the middle and of
    /// the last.
    ///
    /// # Errors
    /// A file that cannot be read; nothing to draw; cancel.
    pub fn open(
        session: &'a Session,
        look: &'a Look,
        mut sources: Sources,
        frames: Vec<i32>,
    ) -> std::result::Result<Self, Failure> {
        let mut places = vec![0, frames.len() / 2, frames.len() - 1];
        places.dedup();
        let mut probe = |place: usize| {
            let parts = sources.read(&session.ctx, Some(f64::from(frames[place])))?;
            look.build(&session.ctx, parts)
        };
        let probes = places.into_iter().map(&mut probe).collect::<Result<Vec<_>>>().before()?;
        let view = look.view(&probes)?;
        Ok(Self { session, look, sources, frames, view, probes })
    }

    /// Writes a PNG file of each frame, in their order, each whole or not at all.
    ///
    /// # Errors
    /// A file that cannot be read or written; cancel: the pictures of the frames before it are there.
    pub fn pictures(mut self, pattern: &Pattern) -> Result<()> {
        self.probes.clear();
        let paths: Vec<_> = self.frames.iter().map(|frame| pattern.path(*frame)).collect();
        let write = |place: usize, png: Vec<u8>| atomic::write_bytes(&paths[place], &png);
        self.draw(|picture| picture.png(), write)
    }

    /// Writes a GIF file, whole or not at all, that plays `fps` frames of the shot a second.
    ///
    /// # Errors
    /// A file that cannot be read or written; cancel.
    pub fn gif(mut self, path: &Path, fps: f64) -> Result<()> {
        let palette = self.palette()?;
        self.probes.clear();
        let (delays, size, ctx) = (delays(&self.frames, fps), self.view.size, &self.session.ctx);
        // The first error of a frame, kept apart so that it is not reported as one of writing.
        let mut ended = None;
        let written = atomic::write(path, |out| {
            let mut gif = Gif::new(out, size, &palette)?;
            let add = |place: usize, indices: Vec<u8>| {
                gif.add(indices, delays[place]).map_err(|error| Error::io(path, "write", error))
            };
            match self.draw(|picture| Ok(palette.indices(ctx, &picture)), add) {
                Ok(()) => gif.finish(),
                Err(error) => {
                    ended = Some(error);
                    Err(std::io::Error::other("the frames ended early"))
                }
            }
        });
        ended.map_or(written, Err)
    }

    /// Draws the frames, several at once: `finish` makes of each picture what `take` then gets in the order of the frames.
    fn draw<T: Send>(
        &mut self,
        finish: impl Fn(Picture) -> Result<T> + Sync,
        mut take: impl FnMut(usize, T) -> Result<()>,
    ) -> Result<()> {
        let Self { session, look, sources, frames, view, .. } = self;
        let ctx = &session.ctx;
        let read = |place: usize| {
            ctx.check()?;
            sources.read(ctx, Some(f64::from(frames[place])))
        };
        let make = |_, parts| finish(view.draw(ctx, &look.build(ctx, parts)?)?);
        let mut progress = FrameProgress::new(ctx, frames.len(), 0, session.is_quiet());
        let at_once = ctx.pool().threads().min(MOST_AT_ONCE);
        in_order(frames.len(), at_once, read, make, |place, made| {
            take(place, made)?;
            progress.finished("picture", frames[place]);
            Ok(())
        })
    }

    /// Colours for all frames, from small pictures of some.
    fn palette(&self) -> Result<Palette> {
        let small = self.view.smaller(SMALLER);
        let draw = |probe: &Drawing| small.draw(&self.session.ctx, probe);
        let pictures = self.probes.iter().map(draw).collect::<Result<Vec<_>>>()?;
        Palette::of(&self.session.ctx, &pictures)
    }
}
