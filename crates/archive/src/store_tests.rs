use super::*;

fn file_names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.retain(|name| name != GATE);
    names.sort();
    names
}

#[test]
fn what_a_killed_process_left_is_taken_away_and_what_a_living_one_makes_is_not() {
    let out = tempfile::tempdir().expect("a folder");
    let store = Store::open(out.path()).expect("a store");
    let living = store.begin().expect("a place");
    let dead = store.begin().expect("a place");
    std::fs::write(dead.path().join("summary.json"), "{}").expect("written");
    // The lock of a killed process is gone, its folder is not.
    let path = dead.folder.keep();
    drop(dead._lock);
    assert_eq!(file_names(&store.results).len(), 2);
    let again = Store::open(out.path()).expect("a store");
    assert!(!path.exists());
    assert!(living.path().exists());
    drop(living);
    assert!(file_names(&again.results).is_empty());
}

#[test]
fn names_stay_in_the_folder() {
    let key = "0123456789abcdef0123";
    assert_eq!(Store::name("2026-03/../../etc/passwd", key), "2026-03_.._.._etc_passwd-0123456789abcdef");
    assert_eq!(Store::name("..", key), "-0123456789abcdef");
    assert_eq!(Store::name(&"x".repeat(500), key).len(), 97);
}
