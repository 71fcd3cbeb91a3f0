//! What is written is read back, and the same twice.

use super::{Style, attachments, mcap_bytes, opaque, open};
use crate::write::output::McapOutput;
use crate::{Recording, RecordingError};
use std::collections::BTreeMap;
use std::path::Path;

/// Copies a recording with an attachment and metadata.
fn copy(recording: &Recording, path: &Path) -> Result<(), RecordingError> {
    let mut out = McapOutput::create(path, "ros2")?;
    let none = BTreeMap::new();
    recording.for_each_raw(&mut |m| {
        let schema = m.channel.schema.as_ref().map(|s| (&*s.name, &*s.encoding, s.data.as_slice()));
        let id = out.add_channel(&m.channel.topic, schema, &m.channel.message_encoding, &none)?;
        out.put(id, m.sequence, m.log_ns, m.publish_ns, m.data)
    })?;
    out.attach("pipeline.toml", "application/toml", 5, 6, b"[streams]")?;
    out.metadata("armcal", &BTreeMap::from([("seed".to_owned(), "7".to_owned())]))?;
    out.finish()
}

#[test]
fn a_copy_holds_the_same_messages_and_is_reproducible() {
    let folder = tempfile::tempdir().expect("a folder");
    let original = open(&mcap_bytes(&[opaque("/a", 500), opaque("/b", 300)], &Style::default()));
    let (one, two) = (folder.path().join("one.mcap"), folder.path().join("two.mcap"));
    copy(&original, &one).expect("written");
    copy(&original, &two).expect("written");
    let bytes = std::fs::read(&one).expect("readable");
    assert_eq!(bytes, std::fs::read(&two).expect("readable"));
    let copied = open(&bytes);
    let messages = |r: &Recording| {
        let mut all = Vec::new();
        let pass = r.for_each_raw(&mut |m| {
            all.push((m.channel.clone(), m.sequence, m.log_ns, m.publish_ns, m.data.to_vec()));
            Ok(())
        });
        pass.expect("nothing stops the pass");
        all
    };
    assert_eq!(messages(&original), messages(&copied));
    assert!(copied.report().warnings.is_empty());
    let expected = ("pipeline.toml".into(), "application/toml".into(), 5, 6, b"[streams]".to_vec());
    assert_eq!(attachments(&copied), [expected]);
    assert_eq!(
        copied.metadata().expect("readable"),
        [("armcal".to_owned(), BTreeMap::from([("seed".to_owned(), "7".to_owned())]))]
    );
}

#[test]
fn a_flipped_attachment_is_not_handed_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("out.mcap");
    copy(&open(&mcap_bytes(&[opaque("/a", 10)], &Style::default())), &path).expect("written");
    let mut bytes = std::fs::read(&path).expect("readable");
    let at = bytes.windows(9).position(|w| w == b"[streams]").expect("the attachment is there");
    bytes[at] ^= 1;
    let recording = open(&bytes);
    assert!(attachments(&recording).is_empty());
    assert!(recording.report().files[0].damaged[0].1.contains("an attachment is damaged"));
}

#[test]
fn an_unfinished_output_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut out = McapOutput::create(&folder.path().join("out.mcap"), "").expect("created");
    let id = out.add_channel("/a", None, "json", &BTreeMap::new()).expect("a channel");
    out.put(id, 0, 1, 1, b"{}").expect("written");
    drop(out);
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
    let error = McapOutput::create(&folder.path().join("no/out.mcap"), "").err().expect("no such folder");
    assert!(error.to_string().contains("no/out.mcap"), "{error}");
}
