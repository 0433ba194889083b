//! Gates of grains in files: other programs see each of them with all of its values.

use std::path::Path;
use std::process::Command;

use frazil::io::usd;
use frazil::snow::grains::Grains;
use frazil::vdb::file::WriteOptions;
use frazil::vdb::points;

use crate::common::clients;
use crate::harness::Harness;
use crate::scenes::context;
use crate::snow::grains::births::ploughed_snow;
use crate::snow::shot::answered;

/// Frame of the files.
const FRAME: i32 = 36;
/// Bytes of a position in a record, after those of the identity.
const POSITION: std::ops::Range<usize> = 8..32;
/// Bytes of a record.
const RECORD: usize = 68;

pub fn run(h: &mut Harness) {
    let [openvdb, usd] = ["snow.grains.readers_openvdb", "snow.grains.readers_usd"];
    if !h.wants(openvdb) && !h.wants(usd) {
        return;
    }
    let ctx = context(2);
    let grains = ploughed_snow(&ctx, FRAME).1;
    let awake = grains.awake().filter(|awake| *awake).count();
    assert!(awake > 0 && awake < grains.count(), "{awake} of {} grains are awake", grains.count());
    let ours = records(&grains);
    let folder = tempfile::tempdir().expect("a folder");
    if h.wants(openvdb) {
        let [file, seen] = ["grains.vdb", "seen"].map(|name| folder.path().join(name));
        points::write(&ctx, &file, "grains", &grains.points(), &WriteOptions::default()).expect("a file");
        let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/ctest/grain_reader");
        match Command::new(program).arg(&file).arg(&seen).output() {
            Err(_) => h.skipped(openvdb, "tests/ctest is not built: make gates does it"),
            Ok(output) => {
                let seen = std::fs::read(&seen).unwrap_or_default();
                let said = String::from_utf8_lossy(&output.stderr).trim().to_string();
                let note = format!("{} grains, {awake} of them awake {said}", grains.count());
                h.gate(openvdb, output.status.success() && is_same(&ours, &seen, &grains), note.trim());
            }
        }
    }
    if h.wants(usd) {
        let answer = clients::usd_python().map(|python| {
            let [file, seen] = ["grains.usdc", "ours"].map(|name| folder.path().join(name));
            let frame = usd::points::frame("grains", FRAME, 24.0, &grains.points());
            std::fs::write(&file, frame.bytes(usd::Format::Binary).expect("a layer")).expect("a file");
            std::fs::write(&seen, &ours).expect("a file");
            clients::usd_reads_grains(&python, &file, &seen, FRAME)
        });
        answered(h, usd, answer);
    }
}

/// All values of the grains by identity, as tests/ctest/full/grain_reader.cpp writes them.
fn records(grains: &Grains) -> Vec<u8> {
    let values = grains.ids().iter().zip(grains.positions()).zip(grains.velocities()).zip(grains.rests());
    let values = values.zip(grains.source_frames()).zip(grains.awake());
    let mut records: Vec<(u32, Vec<u8>)> = values
        .map(|(((((id, position), velocity), rest), frame), is_awake)| {
            let radius = [grains.params().radius as f32];
            let single = velocity.into_iter().chain(rest).chain(radius).flat_map(f32::to_le_bytes);
            let mut bytes = i64::from(*id).to_le_bytes().to_vec();
            bytes.extend(position.iter().flat_map(|x| x.to_le_bytes()).chain(single));
            bytes.extend([frame, i32::from(is_awake)].into_iter().flat_map(i32::to_le_bytes));
            (*id, bytes)
        })
        .collect();
    records.sort_unstable();
    records.into_iter().flat_map(|(_, bytes)| bytes).collect()
}

/// Whether two lists of records hold the same: positions but for the rounding of sums, all else bit for bit.
fn is_same(ours: &[u8], theirs: &[u8], grains: &Grains) -> bool {
    let position = |record: &[u8], axis: usize| {
        let bytes = &record[POSITION][8 * axis..8 * axis + 8];
        f64::from_le_bytes(bytes.try_into().expect("8 bytes"))
    };
    let is_near = |(ours, theirs): (&[u8], &[u8])| {
        let off =
            (0..3).map(|axis| (position(ours, axis) - position(theirs, axis)).abs()).fold(0.0, f64::max);
        let [same, other] = [ours, theirs].map(|record| (&record[..POSITION.start], &record[POSITION.end..]));
        off < 1.0e-6 * grains.params().radius && same == other
    };
    ours.len() == RECORD * grains.count()
        && ours.len() == theirs.len()
        && ours.chunks(RECORD).zip(theirs.chunks(RECORD)).all(is_near)
}
