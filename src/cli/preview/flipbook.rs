//! Flipbooks: a picture of each frame, or a GIF of all of them, from one camera in one light.

use std::path::Path;
use std::time::Instant;

use super::drawing::{Drawing, Look, View};
use super::format::PictureFormat;
use super::in_order::in_order;
use super::sources::Sources;
use crate::cli::frame_results::FrameResults;
use crate::cli::preview::parts::Part;
use crate::cli::session::{Failure, OrFailure, Session};
use crate::cli::shot::progress::{FrameProgress, ProgressFormat};
use crate::cli::shot::remaining::Remaining;
use frazil::io::files::atomic;
use frazil::io::files::sequence::Pattern;
use frazil::render::{Gif, Palette, delays};
use frazil::scene::run::{FrameCosts, Pace, ToMake};
use frazil::{Context, Error, Result};

/// Maximum number of frames made at once: each holds its snow as triangles, and a memory limit applies to each of them.
const MAX_AT_ONCE: usize = 4;
/// The colours of a GIF are chosen from pictures that are smaller by this factor along each edge.
const PALETTE_REDUCTION: u32 = 4;

/// Frames drawn with one camera.
pub struct Flipbook<'a> {
    session: &'a Session,
    look: &'a Look,
    sources: Sources,
    /// Frame numbers, ascending.
    frames: Vec<i32>,
    view: View,
    /// The first frame, the middle one and the last.
    probes: Vec<Drawing>,
}

impl<'a> Flipbook<'a> {
    /// Chooses the camera for some frames, ascending, at least one, so that everything in the first, the middle and the last one is in
    /// the picture. If one of these cannot be drawn, the nearest later frame is used in its place, or else an earlier one.
    ///
    /// # Errors
    /// No frame that can be drawn; nothing to draw; cancel.
    pub fn open(
        session: &'a Session,
        look: &'a Look,
        mut sources: Sources,
        frames: Vec<i32>,
    ) -> std::result::Result<Self, Failure> {
        let mut indices = vec![0, frames.len() / 2, frames.len() - 1];
        indices.dedup();
        let mut probe = |index: usize| {
            let frame = Some(f64::from(frames[index]));
            sources.refuse_missing(frame)?;
            let parts = sources.read(&session.ctx, frame)?;
            look.build(&session.ctx, parts)
        };
        let (mut probes, mut tried, mut first) = (Vec::new(), Vec::new(), None);
        for wanted in indices {
            for index in (wanted..frames.len()).chain((0..wanted).rev()) {
                if tried.contains(&index) {
                    break;
                }
                tried.push(index);
                match probe(index) {
                    Ok(drawing) => {
                        probes.push(drawing);
                        break;
                    }
                    Err(error @ (Error::Cancelled | Error::Argument(_) | Error::Memory { .. })) => {
                        return Err(error).or_refuse();
                    }
                    Err(error) => _ = first.get_or_insert(error),
                }
            }
        }
        if let Some(error) = first.filter(|_| probes.is_empty()) {
            return Err(error).or_refuse();
        }
        let view = look.view(&probes, look.wanted_focus(&mut sources))?;
        Ok(Self { session, look, sources, frames, view, probes })
    }

    /// Writes a picture of each frame atomically, in order; a frame that fails does not stop the others.
    ///
    /// # Errors
    /// Files that cannot be read or written; cancel, after which the pictures of earlier frames remain.
    pub fn pictures(mut self, pattern: &Pattern, format: PictureFormat) -> std::result::Result<(), Failure> {
        self.probes.clear();
        let (frames, mut results) = (self.frames.clone(), FrameResults::default());
        self.draw(
            |ctx, view, drawing| view.encoded(ctx, drawing, format),
            |index, bytes: Result<Vec<u8>>| {
                let written =
                    bytes.and_then(|bytes| atomic::write_bytes(&pattern.path(frames[index]), &bytes));
                results.record(frames[index], written)
            },
        )?;
        results.finish()
    }

    /// Writes a GIF file atomically that plays `fps` frames of the shot per second. Instead of a frame that cannot be drawn, the
    /// previous one is shown longer.
    ///
    /// # Errors
    /// Frames that cannot be drawn; a file that cannot be written; cancel.
    pub fn gif(mut self, path: &Path, fps: f64) -> std::result::Result<(), Failure> {
        let palette = self.palette().or_fail()?;
        self.probes.clear();
        let (delays, size) = (delays(&self.frames, fps), self.view.size);
        let (frames, mut results) = (self.frames.clone(), FrameResults::default());
        // An error of a frame, kept separately so that it is not reported as a write error.
        let mut frame_error = None;
        let written = atomic::write(path, |out| {
            let mut gif = Gif::new(out, size, &palette)?;
            let (mut last_shown, mut pending_delay): (Option<Vec<u8>>, u16) = (None, 0);
            let add = |index: usize, pixels: Result<Vec<u8>>| -> std::result::Result<Option<()>, Failure> {
                let mut delay = delays[index];
                match results.record(frames[index], pixels)? {
                    Some(pixels) => {
                        delay = delay.saturating_add(std::mem::take(&mut pending_delay));
                        last_shown = Some(pixels);
                    }
                    None if last_shown.is_none() => {
                        pending_delay = pending_delay.saturating_add(delay);
                        return Ok(None);
                    }
                    None => {}
                }
                let pixels = last_shown.clone().unwrap_or_default();
                gif.add(pixels, delay).map_err(|error| Failure::failed(Error::io(path, "write", error)))?;
                Ok(Some(()))
            };
            let indices = |ctx: &Context, view: &View, drawing: &Drawing| {
                Ok(palette.indices(ctx, &view.draw(ctx, drawing)?))
            };
            match self.draw(indices, add) {
                Ok(()) => gif.finish(),
                Err(error) => {
                    frame_error = Some(error);
                    Err(std::io::Error::other("the frames ended early"))
                }
            }
        });
        match frame_error {
            Some(error) => Err(error),
            None => written.or_fail().and_then(|()| results.finish()),
        }
    }

    /// Draws the frames, several at once: `finish` draws each picture, and `take` gets the results, or errors, in the order of the
    /// frames; an error of `take` ends the work.
    fn draw<T: Send>(
        &mut self,
        finish: impl Fn(&Context, &View, &Drawing) -> Result<T> + Sync,
        mut take: impl FnMut(usize, Result<T>) -> std::result::Result<Option<()>, Failure>,
    ) -> std::result::Result<(), Failure> {
        let Self { session, look, sources, frames, view, .. } = self;
        let ctx = &session.ctx;
        let read = |index: usize| -> Result<Result<Vec<Part>>> {
            ctx.check()?;
            // An error of a frame is its own result.
            let frame = Some(f64::from(frames[index]));
            Ok(sources.refuse_missing(frame).and_then(|()| sources.read(ctx, frame)))
        };
        let make =
            |_, parts: Result<_>| Ok(parts.and_then(|parts| finish(ctx, view, &look.build(ctx, parts)?)));
        let mut last = Instant::now();
        let pictures =
            ToMake { stage: "picture", frames: frames.iter().map(|frame| *frame..=*frame).collect() };
        let pictures = Remaining::of(&[pictures], &FrameCosts::default(), last);
        let format = ProgressFormat::Text.unless(session.is_quiet());
        let mut progress = FrameProgress::new(ctx, pictures, 0, format);
        let at_once = ctx.pool().threads().min(MAX_AT_ONCE);
        in_order(frames.len(), at_once, read, make, |index, made| {
            if take(index, made)?.is_some() {
                let begun = std::mem::replace(&mut last, Instant::now());
                let pace = Pace { took: last - begun, ..Pace::default() };
                progress.finished("picture", frames[index], pace);
            }
            Ok(())
        })
    }

    /// Colours for all frames, from small pictures of some.
    fn palette(&self) -> Result<Palette> {
        let small = self.view.smaller(PALETTE_REDUCTION);
        let draw = |probe: &Drawing| small.draw(&self.session.ctx, probe);
        let pictures = self.probes.iter().map(draw).collect::<Result<Vec<_>>>()?;
        Palette::of(&self.session.ctx, &pictures)
    }
}
