//! A process that ends at once leaves no file that it has begun. Other writers of this process would lose theirs.

use crate::program::Folder;
use crate::turn;
use frazil::io::files::atomic;

#[test]
fn what_is_begun_goes_when_a_process_ends_at_once() {
    let _turn = turn();
    let folder = Folder::empty();
    let path = folder.join("base.0001.vdb");
    std::fs::write(&path, "whole").unwrap();
    let there = || std::fs::read_dir(&folder).unwrap().count();
    let written = atomic::write(&path, |out| {
        out.write_all(b"half")?;
        assert_eq!(there(), 2);
        atomic::abandon();
        assert_eq!(there(), 1);
        Ok(())
    });
    // Where the process lives on for a moment, the old file stays.
    assert!(written.is_err() && there() == 1);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "whole");
}
