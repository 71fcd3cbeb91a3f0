//! Files that people write, read as text.

use crate::ConfigError;
use armcal_recording::input::{self, Kind};
use std::io::Read as _;
use std::path::Path;

/// The text of a file that people write; a recording or a folder in its place is named for what it is.
pub fn read_text(what: &'static str, kind: Kind, path: &Path) -> Result<String, ConfigError> {
    let failed = |source| ConfigError::ReadFile { what, path: path.to_owned(), source };
    let is = |found, next| Err(ConfigError::NotText { path: path.to_owned(), found, wanted: what, next });
    let own = "name it under [[recordings]] of a pipeline file (docs/pipeline-reference.md), and give that";
    let shown = path.display();
    if path.is_dir() {
        let next = "name the TOML file; recordings are listed in it, under [[recordings]]";
        return is("a folder", format!("{next}; of a folder of them `armcal init {shown}` proposes one"));
    }
    let (mut bytes, mut file) = (Vec::new(), input::open(path).map_err(failed)?);
    file.by_ref().take(16).read_to_end(&mut bytes).map_err(failed)?;
    match bytes.as_slice() {
        b if let Some(what) = recording_kind(b) => is(
            what,
            format!(
                "{own}, or have one proposed: `armcal init {shown}`; `armcal inspect {shown}` shows what is in it"
            ),
        ),
        _ => {
            input::read_on(&mut file, kind, &mut bytes).map_err(failed)?;
            let text = String::from_utf8(bytes);
            text.map_err(|_| failed(std::io::Error::other("it is not UTF-8 text")))
        }
    }
}

/// What kind of recording begins so.
fn recording_kind(head: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 3] = [
        (b"\x89MCAP", "a recording (MCAP)"),
        (b"#ROSBAG", "a ROS 1 bag"),
        (b"SQLite format 3", "a rosbag2 database"),
    ];
    kinds.into_iter().find(|(magic, _)| head.starts_with(magic)).map(|(_, what)| what)
}
