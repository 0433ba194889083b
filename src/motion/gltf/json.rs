//! The JSON of a file, reduced to what moves vertices before the glTF crate reads it: that crate refuses valid files because of data that
//! frazil ignores (materials, textures, channels of extensions, application-specific attributes).

use std::collections::{HashMap, HashSet};

use gltf::Document;
use serde_json::{Map, Value};

use crate::error::one_line;

/// Extensions that are read here, besides those of [`is_harmless`].
const READ: [&str; 4] =
    ["KHR_mesh_quantization", "KHR_animation_pointer", "EXT_mesh_gpu_instancing", COMPRESSION];
const COMPRESSION: &str = "EXT_meshopt_compression";
const INSTANCING: &str = "EXT_mesh_gpu_instancing";
/// Attributes that are read or reported; all others are application-specific.
const SEMANTICS: [&str; 3] = ["POSITION", "NORMAL", "TANGENT"];
const NUMBERED_SEMANTICS: [&str; 4] = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"];
/// Properties of a node that a clip animates.
const PATHS: [&str; 4] = ["translation", "rotation", "scale", "weights"];

/// A parsed file without its buffers.
pub(super) struct Parsed {
    pub document: Document,
    /// The binary chunk of a .glb.
    pub blob: Option<Vec<u8>>,
    /// Compressed buffer views by their index.
    pub compressed: HashMap<usize, Compressed>,
    /// Buffers that exist only for readers without decompression.
    pub fallbacks: Vec<usize>,
    /// Nodes whose mesh is drawn several times.
    pub instances: HashMap<usize, Instancing>,
    /// Accessors of zeros, which have no data.
    pub zeros: HashSet<usize>,
    /// Base colours of primitives, by the indices of mesh and primitive: see [`base_colours`].
    pub base_colours: HashMap<(usize, usize), [f32; 3]>,
    pub has_materials: bool,
}

/// Location and format of the data of a buffer view compressed by meshoptimizer.
pub(super) struct Compressed {
    pub buffer: usize,
    pub offset: usize,
    pub length: usize,
    /// Bytes of an element, and the number of elements.
    pub stride: usize,
    pub count: usize,
    pub mode: String,
    pub filter: String,
}

/// Accessors of the transforms of instances; each may be missing.
#[derive(Default)]
pub(super) struct Instancing {
    pub translation: Option<usize>,
    pub rotation: Option<usize>,
    pub scale: Option<usize>,
}

/// Reads the JSON and checks that everything it references exists.
///
/// # Errors
/// A file that is malformed, or requires an extension that is not read.
pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, String> {
    let invalid = |what: String| format!("not a whole glTF file ({what})");
    let (text, blob) = if bytes.starts_with(b"glTF") {
        chunks(bytes).map_err(invalid)?
    } else {
        // A byte order mark is not allowed, but some programs write one.
        (bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None)
    };
    let blob = blob.map(<[u8]>::to_vec);
    let root: Value = serde_json::from_slice(text).map_err(|error| invalid(one_line(&error.to_string())))?;
    let Value::Object(mut root) = root else { return Err(invalid("its JSON is not an object".into())) };
    check_extensions(&root)?;
    let compressed = compressed(&root).map_err(invalid)?;
    let fallbacks = fallbacks(&root);
    let instances = instances(&root).map_err(invalid)?;
    let has_materials = !elements(&root, "materials").is_empty();
    let base_colours = base_colours(&root);
    let zeros = without_data(&mut root);
    point_at_nodes(&mut root);
    reduce(&mut root);
    let document = checked(Value::Object(root)).map_err(invalid)?;
    Ok(Parsed { document, blob, compressed, fallbacks, instances, zeros, base_colours, has_materials })
}

/// The JSON and the binary chunk of a .glb; other chunks are for extensions.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if word(4) != Some(2) {
        return Err("its version is not 2".into());
    }
    let end = (word(8).unwrap_or(0) as usize).min(bytes.len());
    let (mut at, mut json, mut binary) = (12, None, None);
    while at + 8 <= end {
        let length = word(at).unwrap_or(0) as usize;
        let data = bytes[..end].get(at + 8..at + 8 + length);
        let data = data.ok_or_else(|| format!("its chunk at byte {at} reaches beyond its end"))?;
        match &bytes[at + 4..at + 8] {
            b"JSON" if at == 12 => json = Some(data),
            b"BIN\0" if binary.is_none() => binary = Some(data),
            _ => {}
        }
        at += 8 + length;
    }
    Ok((json.ok_or("its first chunk is not JSON")?, binary))
}

/// Refuses files that require an extension that is not read.
fn check_extensions(root: &Map<String, Value>) -> Result<(), String> {
    let mut required = elements(root, "extensionsRequired").iter().filter_map(Value::as_str);
    match required.find(|name| !READ.contains(name) && !is_harmless(name)) {
        Some(name) => Err(format!("needs the glTF extension {}, which frazil does not read", one_line(name))),
        None => Ok(()),
    }
}

/// Whether an extension concerns only the look of surfaces: materials, textures and their formats, lights, descriptions.
fn is_harmless(name: &str) -> bool {
    let subject = name.split_once('_').map_or("", |(_, subject)| subject);
    ["materials_", "texture_", "lights_", "xmp"].iter().any(|start| subject.starts_with(start))
}

/// The elements of a list of the root.
fn elements<'a>(root: &'a Map<String, Value>, list: &str) -> &'a [Value] {
    root.get(list).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn elements_mut<'a>(object: &'a mut Map<String, Value>, list: &str) -> &'a mut [Value] {
    object.get_mut(list).and_then(Value::as_array_mut).map_or(&mut [], Vec::as_mut_slice)
}

fn index(value: &Value, key: &str) -> Option<usize> {
    value.get(key)?.as_u64()?.try_into().ok()
}

fn extension<'a>(value: &'a Value, name: &str) -> Option<&'a Value> {
    value.get("extensions")?.get(name)
}

fn compressed(root: &Map<String, Value>) -> Result<HashMap<usize, Compressed>, String> {
    let mut out = HashMap::new();
    for (view, value) in elements(root, "bufferViews").iter().enumerate() {
        let Some(value) = extension(value, COMPRESSION) else { continue };
        let number = |key: &str| {
            index(value, key).ok_or_else(|| format!("buffer view {view} has no {key} of its compressed data"))
        };
        let text = |key: &str| value.get(key).and_then(Value::as_str).map(one_line);
        let found = Compressed {
            buffer: number("buffer")?,
            offset: index(value, "byteOffset").unwrap_or(0),
            length: number("byteLength")?,
            stride: number("byteStride")?,
            count: number("count")?,
            mode: text("mode").ok_or_else(|| format!("buffer view {view} has no mode of compression"))?,
            filter: text("filter").unwrap_or_else(|| "NONE".into()),
        };
        out.insert(view, found);
    }
    Ok(out)
}

/// Placeholder buffers for compressed data: they need no data of their own.
fn fallbacks(root: &Map<String, Value>) -> Vec<usize> {
    let is_fallback = |buffer: &Value| {
        extension(buffer, COMPRESSION).and_then(|found| found.get("fallback")).is_some_and(|f| *f == true)
    };
    let buffers = elements(root, "buffers").iter().enumerate();
    buffers.filter(|(_, buffer)| is_fallback(buffer)).map(|(index, _)| index).collect()
}

fn instances(root: &Map<String, Value>) -> Result<HashMap<usize, Instancing>, String> {
    let accessors = elements(root, "accessors").len();
    let mut out = HashMap::new();
    for (node, value) in elements(root, "nodes").iter().enumerate() {
        let Some(attributes) = extension(value, INSTANCING).and_then(|found| found.get("attributes")) else {
            continue;
        };
        let accessor = |key: &str| match index(attributes, key) {
            Some(accessor) if accessor >= accessors => {
                Err(format!("the instances of node {node} refer to an accessor that does not exist"))
            }
            found => Ok(found),
        };
        let found = Instancing {
            translation: accessor("TRANSLATION")?,
            rotation: accessor("ROTATION")?,
            scale: accessor("SCALE")?,
        };
        out.insert(node, found);
    }
    Ok(out)
}

/// Accessors without data: they hold zeros. The crate requires a buffer view, so each gets one, which is not read.
fn without_data(root: &mut Map<String, Value>) -> HashSet<usize> {
    let mut zeros = HashSet::new();
    if elements(root, "bufferViews").is_empty() {
        return zeros;
    }
    for (at, accessor) in elements_mut(root, "accessors").iter_mut().enumerate() {
        let Some(fields) = accessor.as_object_mut() else { continue };
        if !fields.contains_key("bufferView") && !fields.contains_key("sparse") {
            fields.insert("bufferView".into(), 0.into());
            zeros.insert(at);
        }
    }
    zeros
}

/// Turns channels that point at a node's property (KHR_animation_pointer) into ordinary ones.
fn point_at_nodes(root: &mut Map<String, Value>) {
    for animation in elements_mut(root, "animations").iter_mut().filter_map(Value::as_object_mut) {
        for target in elements_mut(animation, "channels").iter_mut().filter_map(|c| c.get_mut("target")) {
            let pointer = extension(target, "KHR_animation_pointer").and_then(|found| found.get("pointer"));
            let parts: Vec<&str> = pointer.and_then(Value::as_str).unwrap_or("").split('/').collect();
            if let ["", "nodes", node, path] = parts[..]
                && let Ok(node) = node.parse::<u32>()
                && PATHS.contains(&path)
            {
                *target = serde_json::json!({ "node": node, "path": path });
            }
        }
    }
}

/// The base colours (linear) of primitives, by the indices of mesh and primitive. Those with a texture have none: the factor alone would
/// show another colour.
fn base_colours(root: &Map<String, Value>) -> HashMap<(usize, usize), [f32; 3]> {
    let colour_of = |material: &Value| -> Option<[f32; 3]> {
        let white = [1.0; 3];
        let Some(parameters) = material.get("pbrMetallicRoughness") else { return Some(white) };
        if parameters.get("baseColorTexture").is_some() {
            return None;
        }
        let Some(factor) = parameters.get("baseColorFactor") else { return Some(white) };
        let part = |at: usize| Some(factor.get(at)?.as_f64()?.clamp(0.0, 1.0) as f32);
        Some([part(0)?, part(1)?, part(2)?])
    };
    let colours: Vec<Option<[f32; 3]>> = elements(root, "materials").iter().map(colour_of).collect();
    let mut out = HashMap::new();
    for (mesh, value) in elements(root, "meshes").iter().enumerate() {
        let primitives = value.get("primitives").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        for (primitive, value) in primitives.iter().enumerate() {
            let colour = index(value, "material").and_then(|material| *colours.get(material)?);
            out.extend(colour.map(|colour| ((mesh, primitive), colour)));
        }
    }
    out
}

/// Removes everything that moves no vertex.
fn reduce(root: &mut Map<String, Value>) {
    for key in
        ["cameras", "images", "materials", "samplers", "textures", "extensionsRequired", "extensionsUsed"]
    {
        root.remove(key);
    }
    root.values_mut().for_each(remove_additions_at_any_depth);
    remove_additions(root);
    let animates_node = |channel: &Value| {
        let target = channel.get("target");
        let path = target.and_then(|target| target.get("path")).and_then(Value::as_str);
        target.is_some_and(|target| target.get("node").is_some())
            && path.is_some_and(|path| PATHS.contains(&path))
    };
    let animations = root.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten();
    for animation in animations {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            // Channels without a node, or of another property, are for extensions.
            channels.retain(animates_node);
        }
    }
    for node in elements_mut(root, "nodes").iter_mut().filter_map(Value::as_object_mut) {
        node.remove("camera");
    }
    for mesh in elements_mut(root, "meshes").iter_mut().filter_map(Value::as_object_mut) {
        for primitive in elements_mut(mesh, "primitives").iter_mut().filter_map(Value::as_object_mut) {
            primitive.remove("material");
            if let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) {
                attributes.retain(|name, _| is_read(name));
            }
            for target in elements_mut(primitive, "targets").iter_mut().filter_map(Value::as_object_mut) {
                target.retain(|name, _| SEMANTICS.contains(&name.as_str()));
            }
        }
    }
}

fn is_read(attribute: &str) -> bool {
    let is_numbered = |start: &&str| {
        let set = attribute.strip_prefix(*start);
        set.is_some_and(|set| !set.is_empty() && set.bytes().all(|byte| byte.is_ascii_digit()))
    };
    SEMANTICS.contains(&attribute) || NUMBERED_SEMANTICS.iter().any(is_numbered)
}

/// Removes extensions and application data, at any depth.
fn remove_additions_at_any_depth(value: &mut Value) {
    match value {
        Value::Array(values) => values.iter_mut().for_each(remove_additions_at_any_depth),
        Value::Object(object) => {
            remove_additions(object);
            object.values_mut().for_each(remove_additions_at_any_depth);
        }
        _ => {}
    }
}

fn remove_additions(object: &mut Map<String, Value>) {
    object.remove("extensions");
    object.remove("extras");
}

/// The document, after a check that everything that it references exists.
fn checked(root: Value) -> Result<Document, String> {
    let mut root: gltf::json::Root =
        serde_json::from_value(root).map_err(|error| one_line(&error.to_string()))?;
    // `Document::from_json` requires the bounds of position accessors, and reads them before it checks that the accessors exist;
    // nothing here needs bounds.
    for attribute in root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.attributes.values())
    {
        let accessor = root
            .accessors
            .get_mut(attribute.value())
            .ok_or("an attribute refers to an accessor that does not exist")?;
        accessor.min = Some(vec![0.0; 3].into());
        accessor.max = Some(vec![0.0; 3].into());
    }
    let (nodes, accessors) = (root.nodes.len(), root.accessors.len());
    for animation in &root.animations {
        let samplers = animation.samplers.len();
        if animation.channels.iter().any(|channel| channel.sampler.value() >= samplers) {
            return Err("a channel refers to a sampler that does not exist".into());
        }
        if animation.channels.iter().any(|channel| channel.target.node.value() >= nodes) {
            return Err("a channel refers to a node that does not exist".into());
        }
        let keys = animation.samplers.iter().flat_map(|sampler| [sampler.input, sampler.output]);
        if keys.into_iter().any(|accessor| accessor.value() >= accessors) {
            return Err("the sampler of an animation refers to an accessor that does not exist".into());
        }
    }
    let targets =
        root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.targets.iter().flatten());
    let mut named = targets.flat_map(|target| [target.positions, target.normals, target.tangents]).flatten();
    if named.any(|accessor| accessor.value() >= accessors) {
        return Err("a morph target refers to an accessor that does not exist".into());
    }
    Document::from_json(root).map_err(|error| one_line(&error.to_string()))
}
