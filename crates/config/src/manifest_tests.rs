use super::*;

fn folder_with(files: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for file in files {
        let path = folder.path().join(file);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("made");
        std::fs::write(path, "x").expect("written");
    }
    folder
}

fn entry_names(manifest: &Manifest) -> Vec<String> {
    manifest.entries.iter().map(RecordingEntry::name).collect()
}

#[test]
fn a_glob_finds_recordings_bags_and_no_results() {
    let folder = folder_with(&[
        "2026-01/a.mcap",
        "2026-02/a.mcap",
        "2026-02/b.mcap",
        "bag/metadata.yaml",
        "bag/bag_0.mcap",
        "bag/bag_1.mcap",
        "campaign/recordings/a-1/run.mcap",
    ]);
    let glob = format!("{}/**/*.mcap", folder.path().display());
    let found = Manifest::of(&[glob], &folder.path().join("campaign")).expect("recordings");
    assert_eq!(entry_names(&found), ["2026-01/a", "2026-02/a", "b", "bag"]);
    let sizes: Vec<usize> = found.entries.iter().map(|e| e.paths.len()).collect();
    assert_eq!(sizes, [1, 1, 1, 2]);
}

#[test]
fn both_kinds_of_manifest_say_the_same() {
    let folder = folder_with(&["one.mcap", "two.mcap"]);
    let toml = folder.path().join("m.toml");
    let entry = |path: &str| format!("[[recordings]]\npaths = [\"{path}\"]\ntilt = {{ roll_deg = 0.0 }}\n");
    std::fs::write(&toml, format!("pipeline = \"p.toml\"\n{}{}", entry("two.mcap"), entry("one.mcap")))
        .expect("written");
    let lines = folder.path().join("m.txt");
    std::fs::write(&lines, "# newest first\n two.mcap\n\none.mcap\n").expect("written");
    let out = folder.path().join("out");
    let [toml, lines] =
        [toml, lines].map(|path| Manifest::of(&[path.display().to_string()], &out).expect("a manifest"));
    assert_eq!(toml.pipeline.as_deref(), Some(folder.path().join("p.toml").as_path()));
    assert_eq!(
        (entry_names(&toml), entry_names(&lines)),
        (vec!["two".into(), "one".into()], vec!["two".into(), "one".into()])
    );
    assert_eq!(toml.entries[0].paths, lines.entries[0].paths);
    assert!(toml.entries[0].paths[0].is_absolute());
}

#[test]
fn what_is_wrong_is_named() {
    let folder = folder_with(&["m.toml", "a.mcap"]);
    let say = |inputs: &[String]| Manifest::of(inputs, Path::new("out")).expect_err("wrong").to_string();
    let at = |name: &str| folder.path().join(name).display().to_string();
    assert!(say(&[at("*.bag")]).contains("matches no recording"));
    assert!(say(&[at("m.toml"), at("a.mcap")]).contains("only input"));
    std::fs::write(at("m.toml"), "[[recordings]]\npath = [\"a.mcap\"]\n").expect("written");
    assert!(say(&[at("m.toml")]).contains("line 2"));
    let twice = "[[recordings]]\nname = \"x\"\npaths = [\"a.mcap\"]\n".repeat(2);
    std::fs::write(at("m.toml"), twice).expect("written");
    assert!(say(&[at("m.toml")]).contains("recordings 1 and 2 are both called `x`"));
}
