//! Particle caches as other programs write them, made by code: four particles in each format and encoding.

use std::fmt::Write as _;
use std::io::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

/// Positions (m), velocities (m/s), identities and one more number of the four.
pub const POSITIONS: [[f32; 3]; 4] =
    [[0.1, -2.5, 1e-7], [1.0, 0.0, 3.0], [4.0, 5.0, -6.0], [0.25, 0.5, 0.75]];
pub const VELOCITIES: [[f32; 3]; 4] = [[0.0, -9.81, 0.0], [1.5, 0.1, 0.2], [-1.0, 2.0, 3.0], [0.0; 3]];
pub const IDS: [u32; 4] = [7, 3_000_000_000, 0, 12];
pub const KINDS: [u8; 4] = [0, 1, 255, 1];

/// Bytes in gzip.
pub fn zipped(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

/// Numbers as text or as big-endian bytes.
fn vtk_numbers<T: ToString, const N: usize>(
    out: &mut Vec<u8>,
    binary: bool,
    numbers: &[T],
    bytes: fn(&T) -> [u8; N],
) {
    for number in numbers {
        match binary {
            true => out.extend(bytes(number)),
            false => out.extend((number.to_string() + " ").bytes()),
        }
    }
    out.push(b'\n');
}

/// A legacy .vtk file; `version` says how it has its cells.
pub fn vtk(binary: bool, version: &str, dataset: &str) -> Vec<u8> {
    let encoding = if binary { "BINARY" } else { "ASCII" };
    let head = format!("# vtk DataFile Version {version}\nparticles\n{encoding}\nDATASET {dataset}\n");
    let mut out = (head + "FIELD FieldData 1\nTIME 1 1 double\n").into_bytes();
    vtk_numbers(&mut out, binary, &[0.5f64], |n| n.to_be_bytes());
    out.extend(b"POINTS 4 float\n");
    vtk_numbers(&mut out, binary, POSITIONS.as_flattened(), |n| n.to_be_bytes());
    let cells = if dataset == "POLYDATA" { "VERTICES" } else { "CELLS" };
    if version == "5.1" {
        out.extend(b"METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n");
        out.extend(format!("{cells} 5 4\nOFFSETS vtktypeint64\n").bytes());
        vtk_numbers(&mut out, binary, &[0i64, 1, 2, 3, 4], |n| n.to_be_bytes());
        out.extend(b"CONNECTIVITY vtktypeint64\n");
        vtk_numbers(&mut out, binary, &[0i64, 1, 2, 3], |n| n.to_be_bytes());
    } else {
        out.extend(format!("{cells} 4 8\n").bytes());
        vtk_numbers(&mut out, binary, &[1i32, 0, 1, 1, 1, 2, 1, 3], |n| n.to_be_bytes());
    }
    if cells == "CELLS" {
        out.extend(b"CELL_TYPES 4\n");
        vtk_numbers(&mut out, binary, &[1i32; 4], |n| n.to_be_bytes());
    }
    out.extend(b"CELL_DATA 4\nSCALARS id int 1\nLOOKUP_TABLE default\n");
    vtk_numbers(&mut out, binary, &[9i32; 4], |n| n.to_be_bytes());
    out.extend(b"POINT_DATA 4\nSCALARS id unsigned_int 1\nLOOKUP_TABLE id_table\n");
    vtk_numbers(&mut out, binary, &IDS, |n| n.to_be_bytes());
    out.extend(b"VECTORS velocity float\n");
    vtk_numbers(&mut out, binary, VELOCITIES.as_flattened(), |n| n.to_be_bytes());
    out.extend(b"METADATA\nCOMPONENT_NAMES\nvx\n\n\nINFORMATION 0\n\n");
    out.extend(b"FIELD FieldData 3\nkind 1 4 unsigned_char\n");
    vtk_numbers(&mut out, binary, &KINDS, |n| n.to_be_bytes());
    out.extend(b"mass%20of%20each 1 4 double\n");
    vtk_numbers(&mut out, binary, &[0.125f64; 4], |n| n.to_be_bytes());
    out.extend(b"pair 2 4 long\n");
    vtk_numbers(&mut out, binary, &[5i64; 8], |n| n.to_be_bytes());
    out
}

/// How a .vtu file has its arrays.
#[derive(Debug, Clone, Copy)]
pub struct Vtu {
    pub format: &'static str,
    /// Of appended data.
    pub encoding: &'static str,
    /// Bytes of a compressed block: by LZ4 where lengths are long, else by zlib.
    pub blocks: Option<usize>,
    pub long: bool,
    pub big: bool,
    pub pieces: usize,
}

impl Vtu {
    /// Every encoding.
    pub fn all() -> Vec<Self> {
        let mut out = Vec::new();
        for (format, encoding) in [("ascii", ""), ("binary", ""), ("appended", "raw"), ("appended", "base64")]
        {
            for blocks in [None, Some(16), Some(5), Some(1 << 15)] {
                for (long, big, pieces) in
                    [(false, false, 1), (true, false, 2), (true, true, 1), (false, true, 4)]
                {
                    out.push(Self { format, encoding, blocks, long, big, pieces });
                }
            }
        }
        out
    }

    fn number<const N: usize>(&self, little: [u8; N]) -> Vec<u8> {
        if self.big { little.iter().rev().copied().collect() } else { little.to_vec() }
    }

    fn head(&self, numbers: &[usize]) -> Vec<u8> {
        let head = |&number: &usize| match self.long {
            true => self.number((number as u64).to_le_bytes()),
            false => self.number((number as u32).to_le_bytes()),
        };
        numbers.iter().flat_map(head).collect()
    }

    /// An array behind its lengths.
    fn packed(&self, bytes: &[u8]) -> Vec<u8> {
        let is_text = self.format == "binary" || self.encoding == "base64";
        let text = |bytes: &[u8]| if is_text { STANDARD.encode(bytes).into_bytes() } else { bytes.to_vec() };
        let Some(size) = self.blocks else {
            return text(&[self.head(&[bytes.len()]), bytes.to_vec()].concat());
        };
        let blocks: Vec<Vec<u8>> = bytes
            .chunks(size)
            .map(|block| {
                if self.long {
                    return lz4_flex::block::compress(block);
                }
                let mut out = ZlibEncoder::new(Vec::new(), Compression::default());
                out.write_all(block).unwrap();
                out.finish().unwrap()
            })
            .collect();
        let mut head = vec![blocks.len(), size, bytes.len() % size];
        head.extend(blocks.iter().map(Vec::len));
        // The lengths are a piece of their own.
        [text(&self.head(&head)), text(&blocks.concat())].concat()
    }

    /// The file's bytes.
    pub fn file(&self) -> Vec<u8> {
        let attribute = |name: &str, value: Option<&str>| {
            value.map_or(String::new(), |value| format!(" {name}=\"{value}\""))
        };
        let mut xml = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\"{}{}{}>\n<UnstructuredGrid>\n",
            attribute("byte_order", Some(if self.big { "BigEndian" } else { "LittleEndian" })),
            attribute("header_type", Some("UInt64").filter(|_| self.long)),
            attribute(
                "compressor",
                self.blocks.map(|_| if self.long { "vtkLZ4DataCompressor" } else { "vtkZLibDataCompressor" })
            ),
        );
        let mut appended = Vec::new();
        for points in POSITIONS
            .chunks(4 / self.pieces)
            .enumerate()
            .map(|(n, points)| n * points.len()..(n + 1) * points.len())
        {
            let _ =
                writeln!(xml, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"0\">\n<PointData>", points.len());
            let floats = |numbers: &[f32]| -> (Vec<u8>, String) {
                (numbers.iter().flat_map(|n| self.number(n.to_le_bytes())).collect(), format!("{numbers:?}"))
            };
            let ids = (
                IDS[points.clone()].iter().flat_map(|n| self.number(n.to_le_bytes())).collect(),
                format!("{:?}", &IDS[points.clone()]),
            );
            let kinds = (KINDS[points.clone()].to_vec(), format!("{:?}", &KINDS[points.clone()]));
            let [pair, mass] = [2, 1].map(|count| floats(&vec![0.125; count * points.len()]));
            let mut array = |name: &str, kind: &str, components: usize, (bytes, text): (Vec<u8>, String)| {
                let offset = (self.format == "appended").then(|| appended.len().to_string());
                let _ = write!(
                    xml,
                    "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"{}\"{}><InformationKey/>",
                    self.format,
                    attribute("offset", offset.as_deref())
                );
                match self.format {
                    "ascii" => xml += &text.replace(['[', ']', ','], " "),
                    "binary" => xml += &format!("\n  {}\n", String::from_utf8(self.packed(&bytes)).unwrap()),
                    _ => appended.extend(self.packed(&bytes)),
                }
                xml += "</DataArray>\n";
            };
            array("id", "UInt32", 1, ids);
            array("velocity", "Float32", 3, floats(VELOCITIES[points.clone()].as_flattened()));
            array("kind", "UInt8", 1, kinds);
            array("mass of each", "Float32", 1, mass);
            array("pair", "Float32", 2, pair);
            let positions = floats(POSITIONS[points.clone()].as_flattened());
            array("Points", "Float32", 3, positions);
            // Points have a position of their own.
            let at = xml.rfind("<DataArray").unwrap();
            xml.insert_str(
                at,
                "<Array type=\"String\" Name=\"text\" format=\"ascii\">1 2</Array></PointData>\n<Points>",
            );
            xml += "</Points>\n</Piece>\n";
        }
        xml += "</UnstructuredGrid>\n";
        let mut out = xml.into_bytes();
        if self.format == "appended" {
            out.extend(format!("<AppendedData encoding=\"{}\">\n _", self.encoding).bytes());
            out.extend(appended);
            out.extend(b"\n</AppendedData>\n");
        }
        out.extend(b"</VTKFile>");
        out
    }
}

/// A classic .bgeo with an attribute of texts before its velocities.
pub fn bgeo() -> Vec<u8> {
    let mut out = b"BgeoV".to_vec();
    let name = |out: &mut Vec<u8>, name: &str, size: u16, kind: u32| {
        out.extend((name.len() as u16).to_be_bytes());
        out.extend(name.bytes());
        out.extend(size.to_be_bytes());
        out.extend(kind.to_be_bytes());
    };
    [5u32, 4, 0, 0, 0, 5, 0, 0, 0].iter().for_each(|number| out.extend(number.to_be_bytes()));
    name(&mut out, "id", 1, 1);
    out.extend([0; 4]);
    name(&mut out, "material", 1, 4);
    out.extend(2u32.to_be_bytes());
    out.extend(b"\x00\x03wet\x00\x05foamy");
    name(&mut out, "velocity", 3, 5);
    out.extend([0; 12]);
    name(&mut out, "uv", 2, 0);
    out.extend([0; 8]);
    name(&mut out, "pscale", 1, 0);
    out.extend([0; 4]);
    for n in 0..4 {
        POSITIONS[n].iter().chain(&[1.0]).for_each(|part| out.extend(part.to_be_bytes()));
        out.extend((n as i32 - 1).to_be_bytes());
        out.extend(1u32.to_be_bytes());
        VELOCITIES[n].iter().chain(&[0.5, 0.5, 0.125]).for_each(|part| out.extend(part.to_be_bytes()));
    }
    out.extend([0x00, 0xff]);
    out
}

/// A small file of each format and encoding, with a name.
pub fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let mut out = vec![("a.bgeo", bgeo()), ("z.bgeo", zipped(&bgeo()))];
    for version in ["4.1", "5.1"] {
        out.push(("a.vtk", vtk(false, version, "POLYDATA")));
        out.push(("b.vtk", vtk(true, version, "UNSTRUCTURED_GRID")));
    }
    let vtu = Vtu { format: "ascii", encoding: "", blocks: None, long: false, big: false, pieces: 2 };
    for (format, encoding) in [("ascii", ""), ("binary", ""), ("appended", "raw"), ("appended", "base64")] {
        out.push(("a.vtu", Vtu { format, encoding, ..vtu }.file()));
        out.push(("b.vtu", Vtu { format, encoding, blocks: Some(16), ..vtu }.file()));
        out.push(("c.vtu", Vtu { format, encoding, blocks: Some(16), long: true, ..vtu }.file()));
    }
    out.push(("a.xyz", b"0.1 -2.5 1e-7\n1 0 3\n4 5 -6\n".to_vec()));
    out.push((
        "b.xyz",
        [0.1f32, -2.5, 1e-7, 1.0, 0.0, 3.0].iter().flat_map(|part| part.to_le_bytes()).collect(),
    ));
    out
}
