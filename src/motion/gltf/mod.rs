//! Animated characters in glTF 2.0 files (.gltf, .glb): node animation, skins, morph targets.
//!
//! As the format specifies (Khronos, glTF 2.0 specification, sections 3.7 and 3.11): a skinned vertex is the weighted sum of its joints'
//! matrices, and its own node's transform does not count; rotations are interpolated along the shorter arc.

mod clip;
mod file;
mod json;
mod meshopt;
mod nodes;
mod skin;
mod uri;

use std::collections::HashMap;
use std::path::Path;

use super::drawn::Used;
use super::{Drawn, Motion};
use crate::error::{Error, Result};
use crate::geometry::{DVec3, TriMesh};
use crate::io::files::caught::caught;
use clip::{Clip, JUMP};
use file::File;
use nodes::Node;
use skin::Vertices;

/// Repeats of a clip start with a jump if its first and last pose differ by more than this fraction of the character's size.
const SAME_POSE: f64 = 1e-3;
/// Kinks this close to the ends of an interval (s) count as the ends: times in files are 32-bit floats.
const AT_END: f64 = 2e-5;

/// A clip shorter than this (s) is a pose: it does not repeat.
const MIN_CYCLE: f64 = 1e-3;

/// Which parts of a file are wanted, and when they play.
#[derive(Debug, Clone, PartialEq)]
pub struct Play {
    /// Only nodes of this name, and their descendants; `*` matches any characters, `?` one. None: all.
    pub node: Option<String>,
    /// The clip's name; empty: the rest pose. None: the only clip, or the rest pose if there is none.
    pub clip: Option<String>,
    /// Whether the clip starts again when it ends.
    pub repeat: bool,
    /// Time in the shot at which the clip's first key plays (s).
    pub start: f64,
}

impl Default for Play {
    fn default() -> Self {
        Self { node: None, clip: None, repeat: true, start: 0.0 }
    }
}

/// Contents of a glTF file.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// Clips with their lengths (s).
    pub clips: Vec<(String, f64)>,
    /// Names of the nodes with a mesh.
    pub mesh_nodes: Vec<String>,
    /// Those nodes and all their ancestors, parents first: name, depth in the tree, whether it has a mesh.
    pub tree: Vec<(String, usize, bool)>,
    /// Number of skins.
    pub skins: usize,
}

/// The moving meshes of a glTF file.
pub struct Character {
    nodes: Vec<Node>,
    /// Node indices, parents first.
    order: Vec<usize>,
    vertices: Vertices,
    used: Used,
    clip: Option<Clip>,
    play: Play,
    kinks: Vec<f64>,
    /// Length of the jump when the clip repeats, if its ends differ (the file's unit).
    jump: Option<f64>,
    /// Hash of the file and its buffers.
    content: String,
}

impl Character {
    /// Opens a file. Vertices are welded if they agree in position, joints, weights and morph targets.
    ///
    /// # Errors
    /// A file that is truncated or malformed, or names a missing buffer; a clip or node that does not exist (the existing ones are named);
    /// several clips and none chosen; no triangles.
    pub fn open(path: &Path, play: Play) -> Result<Self> {
        caught(path, || Self::read(path, play))
    }

    fn read(path: &Path, play: Play) -> Result<Self> {
        let file = File::open(path)?;
        let wrong = |what: String| Error::file(path, what);
        let nodes = nodes::read(&file.document);
        let order = nodes::parents_first(&nodes).ok_or_else(|| wrong("a node is its own ancestor".into()))?;
        let shown = chosen(&file, &nodes, play.node.as_deref()).map_err(wrong)?;
        let name = |node: usize| nodes[node].name.as_str();
        let mut vertices = Vertices::read(&file, |node| shown[node], name).map_err(wrong)?;
        if vertices.triangles.is_empty() {
            return Err(wrong("holds no triangles".into()));
        }
        let clip = clip(&file, play.clip.as_deref()).map_err(wrong)?;
        let kinks = clip.as_ref().map(Clip::kinks).unwrap_or_default();
        let rest: Vec<_> = nodes.iter().map(|node| node.rest.clone()).collect();
        vertices.face_outward(&nodes::globals(&nodes, &order, &rest));
        let used = Used::of(vertices.count, &vertices.triangles);
        let (jump, content) = (None, file.content);
        let mut character = Self { nodes, order, vertices, used, clip, play, kinks, jump, content };
        character.jump = character.find_jump();
        Ok(character)
    }

    /// Hash of the file and its buffers, as they were read.
    pub fn content(&self) -> &str {
        &self.content
    }

    /// The contents of a file.
    ///
    /// # Errors
    /// A file that is truncated or malformed; a clip with malformed keys.
    pub fn describe(path: &Path) -> Result<Contents> {
        caught(path, || Self::contents(path))
    }

    fn contents(path: &Path) -> Result<Contents> {
        let file = File::open(path)?;
        let wrong = |what: String| Error::file(path, what);
        let clips = clip_names(&file).into_iter().zip(file.document.animations()).map(|(name, animation)| {
            let clip = Clip::read(&file, &animation).map_err(wrong)?;
            Ok((name, clip.end - clip.start))
        });
        let nodes = nodes::read(&file.document);
        let meshes = file.document.nodes().filter(|node| node.mesh().is_some());
        Ok(Contents {
            clips: clips.collect::<Result<_>>()?,
            mesh_nodes: meshes.map(|node| nodes[node.index()].name.clone()).collect(),
            tree: tree(&file, &nodes),
            skins: file.document.skins().count(),
        })
    }

    /// The meshes of a file at a time (s) of a shot (the file's unit).
    ///
    /// # Errors
    /// As [`Character::open`].
    pub fn posed(path: &Path, play: Play, time: f64) -> Result<TriMesh> {
        Self::open(path, play)?.mesh_at(time)
    }

    /// Names of a file's contents besides positions, triangles and motion, in the plural: "UVs", "materials" ...
    ///
    /// # Errors
    /// A file that is truncated or malformed.
    pub fn extras(path: &Path) -> Result<Vec<&'static str>> {
        caught(path, || {
            let File { document, has_materials, .. } = File::open(path)?;
            let has = |wanted: fn(&gltf::Semantic) -> bool| {
                let mut parts = document.meshes().flat_map(|mesh| mesh.primitives());
                parts.any(|part| part.attributes().any(|(name, _)| wanted(&name)))
            };
            let contents = [
                (has(|name| matches!(name, gltf::Semantic::TexCoords(0))), "UVs"),
                (has(|name| matches!(name, gltf::Semantic::TexCoords(1..))), "further UVs"),
                (has(|name| matches!(name, gltf::Semantic::Normals)), "normals"),
                (has(|name| matches!(name, gltf::Semantic::Colors(_))), "colours"),
                (has_materials, "materials"),
            ];
            Ok(contents.into_iter().filter(|(is_present, _)| *is_present).map(|(_, name)| name).collect())
        })
    }

    /// The meshes of a file in their rest pose (the file's unit).
    ///
    /// # Errors
    /// As [`Character::open`].
    pub fn at_rest(path: &Path) -> Result<TriMesh> {
        Self::at_rest_from(path, DVec3::zeros())
    }

    /// As [`Character::at_rest`], minus `origin`, which is subtracted in 64 bits.
    ///
    /// # Errors
    /// As [`Character::open`].
    pub fn at_rest_from(path: &Path, origin: DVec3) -> Result<TriMesh> {
        let rest = Self::open(path, Play { clip: Some(String::new()), ..Play::default() })?;
        let mut pose = Vec::new();
        rest.pose_at_own(0.0, &mut pose);
        Ok(TriMesh {
            positions: pose.iter().map(|position| (position - origin).cast()).collect(),
            triangles: rest.vertices.triangles,
        })
    }

    /// How far a vertex jumps when the clip starts again (the file's unit), if its ends differ and it starts again between two times (s).
    pub fn jump(&self, from: f64, to: f64) -> Option<f64> {
        let round = |time: f64| ((time - self.play.start) / self.duration()).floor();
        self.jump.filter(|_| round(from) != round(to))
    }

    /// Length of the clip (s): from its first key to its last.
    pub fn duration(&self) -> f64 {
        self.clip.as_ref().map_or(0.0, |clip| clip.end - clip.start)
    }

    /// Whether the clip plays more than once.
    fn repeats(&self) -> bool {
        self.play.repeat && self.duration() > MIN_CYCLE
    }

    /// The clip's own time (s) at a time of the shot.
    fn own_time(&self, time: f64) -> f64 {
        let Some(clip) = &self.clip else { return 0.0 };
        let (played, duration) = (time - self.play.start, self.duration());
        let own = if self.repeats() { played.rem_euclid(duration) } else { played.clamp(0.0, duration) };
        clip.start + own
    }

    fn pose_at_own(&self, own: f64, out: &mut Vec<DVec3>) {
        let mut locals: Vec<_> = self.nodes.iter().map(|node| node.rest.clone()).collect();
        if let Some(clip) = &self.clip {
            clip.apply(own, &mut locals);
        }
        let globals = nodes::globals(&self.nodes, &self.order, &locals);
        self.vertices.pose(&locals, &globals, out);
    }

    fn find_jump(&self) -> Option<f64> {
        let clip = self.clip.as_ref().filter(|_| self.repeats())?;
        let (mut first, mut last) = (Vec::new(), Vec::new());
        for (time, pose) in [(clip.start, &mut first), (clip.end, &mut last)] {
            self.pose_at_own(time, pose);
            self.used.keep(pose);
        }
        let size = first.iter().fold((first[0], first[0]), |(l, h), p| (l.inf(p), h.sup(p)));
        let farthest = first.iter().zip(&last).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        (farthest > SAME_POSE * (size.1 - size.0).norm()).then_some(farthest)
    }
}

impl Motion for Character {
    fn triangles(&self) -> &[[u32; 3]] {
        self.used.triangles(&self.vertices.triangles)
    }

    fn vertex_count(&self) -> usize {
        self.used.count
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.pose_at_own(self.own_time(time), out);
        self.used.keep(out);
        Ok(())
    }

    fn drawn(&self) -> Drawn<'_> {
        let drawn = &self.vertices.drawn;
        Drawn {
            vertices: drawn.vertices.len(),
            triangles: &drawn.triangles,
            uvs: drawn.uvs.as_ref(),
            parts: Some(&drawn.parts),
        }
    }

    fn drawn_pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let mut moving = Vec::new();
        self.pose_at_own(self.own_time(time), &mut moving);
        out.clear();
        out.extend(self.vertices.drawn.vertices.iter().map(|&vertex| moving[vertex as usize]));
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        let Some(clip) = &self.clip else { return Vec::new() };
        let duration = self.duration();
        let cycles = if self.repeats() {
            let cycle = |time: f64| ((time - self.play.start) / duration).floor() as i64;
            cycle(from)..=cycle(to)
        } else {
            0..=0
        };
        let mut out = Vec::new();
        for cycle in cycles {
            let begin = self.play.start + cycle as f64 * duration;
            out.extend(self.kinks.iter().map(|kink| begin + kink - clip.start));
            if self.jump.is_some() {
                out.extend([begin - JUMP, begin]);
            }
        }
        out.retain(|&time| time > from + AT_END && time < to - AT_END);
        out.sort_unstable_by(f64::total_cmp);
        out.dedup_by(|later, earlier| *later - *earlier < AT_END);
        out
    }

    fn is_welded(&self) -> bool {
        true
    }
}

/// Whether each node is part of the scene and of the selection.
fn chosen(file: &File, nodes: &[Node], pattern: Option<&str>) -> std::result::Result<Vec<bool>, String> {
    let mut shown = vec![false; nodes.len()];
    let scene = file.document.default_scene().or_else(|| file.document.scenes().next());
    match &scene {
        Some(scene) => scene.nodes().for_each(|root| shown[root.index()] = true),
        None => nodes.iter().zip(&mut shown).for_each(|(node, shown)| *shown = node.parent.is_none()),
    }
    let roots = shown.clone();
    let mut picked: Vec<bool> =
        nodes.iter().map(|node| pattern.is_none_or(|p| matches(p, &node.name))).collect();
    let is_match = picked.clone();
    for index in 0..nodes.len() {
        let mut at = Some(index);
        while let Some(node) = at {
            shown[index] |= roots[node];
            picked[index] |= is_match[node];
            at = nodes[node].parent;
        }
    }
    let meshes: Vec<usize> =
        file.document.nodes().filter(|n| n.mesh().is_some() && shown[n.index()]).map(|n| n.index()).collect();
    if !meshes.iter().any(|&node| picked[node]) {
        let names = meshes.iter().map(|&node| nodes[node].name.as_str());
        return Err(match pattern {
            Some(pattern) => {
                format!("no node \"{pattern}\" has a mesh; those with one are {}", listed(names))
            }
            None => "no node of its scene has a mesh".into(),
        });
    }
    Ok(shown.iter().zip(&picked).map(|(shown, picked)| *shown && *picked).collect())
}

/// The nodes with a mesh and their ancestors, as [`Contents::tree`].
fn tree(file: &File, nodes: &[Node]) -> Vec<(String, usize, bool)> {
    let mut has_mesh = vec![false; nodes.len()];
    file.document.nodes().for_each(|node| has_mesh[node.index()] = node.mesh().is_some());
    let mut shown = has_mesh.clone();
    let mut children = vec![Vec::new(); nodes.len()];
    let mut roots = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        match node.parent {
            Some(parent) => children[parent].push(index),
            None => roots.push(index),
        }
        let mut at = node.parent.filter(|_| has_mesh[index]);
        // At most as many steps as there are nodes: ends even if the tree has a cycle.
        for _ in 0..nodes.len() {
            let Some(parent) = at else { break };
            shown[parent] = true;
            at = nodes[parent].parent;
        }
    }
    let mut out = Vec::new();
    let mut stack: Vec<(usize, usize)> = roots.into_iter().rev().map(|root| (root, 0)).collect();
    while let Some((index, depth)) = stack.pop() {
        if shown[index] {
            out.push((nodes[index].name.clone(), depth, has_mesh[index]));
            stack.extend(children[index].iter().rev().map(|&child| (child, depth + 1)));
        }
    }
    out
}

/// A name for each clip: its own, or its index if it has none; clips that share a name are numbered: "go #1", "go #2".
fn clip_names(file: &File) -> Vec<String> {
    let own =
        |clip: gltf::Animation| clip.name().map_or_else(|| format!("clip {}", clip.index()), str::to_string);
    let own: Vec<String> = file.document.animations().map(own).collect();
    let mut taken: HashMap<&str, usize> = HashMap::new();
    own.iter().for_each(|name| *taken.entry(name).or_default() += 1);
    let mut names: Vec<String> = Vec::new();
    for name in &own {
        let mut numbered = name.clone();
        let mut number = 1;
        while taken[name.as_str()] > 1
            && (numbered == *name || taken.contains_key(&*numbered) || names.contains(&numbered))
        {
            numbered = format!("{name} #{number}");
            number += 1;
        }
        names.push(numbered);
    }
    names
}

fn clip(file: &File, name: Option<&str>) -> std::result::Result<Option<Clip>, String> {
    let names = clip_names(file);
    let all = || listed(names.iter().map(String::as_str));
    let number = match (name, names.len()) {
        (Some(""), _) | (None, 0) => return Ok(None),
        (None, 1) => 0,
        (None, count) => return Err(format!("has {count} clips and none is chosen; they are {}", all())),
        (Some(name), 0) => return Err(format!("has no clip \"{name}\", and no other")),
        (Some(name), _) => names.iter().position(|own| own == name).ok_or_else(|| {
            let same = file.document.animations().filter(|clip| clip.name() == Some(name)).count();
            match same {
                0 => format!("has no clip \"{name}\"; its clips are {}", all()),
                _ => format!("has {same} clips \"{name}\": choose one of {}", all()),
            }
        })?,
    };
    let animation = file.document.animations().nth(number).ok_or("has no such clip")?;
    let clip = Clip::read(file, &animation).map_err(|what| format!("clip \"{}\": {what}", names[number]))?;
    Ok(Some(clip))
}

/// Names in quotes, at most two dozen.
fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    const MAX_LISTED: usize = 24;
    let names: Vec<&str> = names.collect();
    let mut text: Vec<String> = names.iter().take(MAX_LISTED).map(|name| format!("\"{name}\"")).collect();
    if names.len() > MAX_LISTED {
        text.push(format!("{} more", names.len() - MAX_LISTED));
    }
    text.join(", ")
}

/// Whether a name matches a pattern in which `*` stands for any characters and `?` for one.
fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(&character) if character == '?' || character == name[n] => (p, n) = (p + 1, n + 1),
            _ => match star {
                // The last star takes one more character.
                Some((at, taken)) => {
                    star = Some((at, taken + 1));
                    (p, n) = (at + 1, taken + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|&character| character == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_any_letters() {
        for (pattern, name, does_match) in [
            ("hero*", "hero_body", true),
            ("*body", "hero_body", true),
            ("h*o*y", "hero_body", true),
            ("hero", "hero_body", false),
            ("h?ro", "hero", true),
            ("*", "", true),
            ("?", "", false),
            ("a*b", "a*bc", false),
        ] {
            assert_eq!(matches(pattern, name), does_match, "{pattern} {name}");
        }
    }
}
