//! Paths that match a pattern. `**` goes down folders, and not through links: they may lead in circles.

use std::path::{Path, PathBuf};

/// What matches, in no order; and every folder on the way that could not be looked into, which is a recording that fails and not the
/// end of the others.
///
/// # Errors
/// A pattern that is none.
pub(super) fn matching_paths(pattern: &str) -> Result<Vec<PathBuf>, String> {
    let parts: Vec<&str> = pattern.split('/').collect();
    let Some(deep) = parts.iter().position(|part| *part == "**") else { return glob_paths(pattern) };
    let options = glob::MatchOptions { require_literal_separator: true, ..glob::MatchOptions::new() };
    let wanted = glob::Pattern::new(pattern).map_err(|e| e.to_string())?;
    let roots = match &parts[..deep] {
        [] => vec![PathBuf::new()],
        [""] => vec![PathBuf::from("/")],
        before => glob_paths(&before.join("/"))?,
    };
    let (mut found, mut folders) = (Vec::new(), roots);
    while let Some(folder) = folders.pop() {
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
        let entries = match std::fs::read_dir(here) {
            Ok(entries) => entries,
            // A file in the place of a folder has nothing below it.
            Err(e) if e.kind() == std::io::ErrorKind::NotADirectory => continue,
            Err(_) => {
                found.push(folder);
                continue;
            }
        };
        for entry in entries {
            let Ok(entry) = entry else { continue };
            let path = folder.join(entry.file_name());
            // Of a link this is the link, not what it leads to.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path.clone());
            }
            if wanted.matches_path_with(&path, options) {
                found.push(path);
            }
        }
    }
    Ok(found)
}

/// What matches a pattern that stays in its folders.
fn glob_paths(pattern: &str) -> Result<Vec<PathBuf>, String> {
    let found = glob::glob(pattern).map_err(|e| e.to_string())?;
    Ok(found.map(|path| path.unwrap_or_else(|e| e.path().to_owned())).collect())
}

#[cfg(test)]
mod tests {
    use super::matching_paths;
    use std::path::PathBuf;

    #[test]
    #[cfg(unix)]
    fn folders_are_gone_down_and_links_that_lead_in_circles_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        for name in ["a", "b/deep/er"] {
            std::fs::create_dir_all(at(name)).expect("a folder");
        }
        for (name, to) in
            [("a/b", "b"), ("a/again", "b"), ("b/a", "a"), ("b/again", "a"), ("file.mcap", "a/x.mcap")]
        {
            std::os::unix::fs::symlink(at(to), at(name)).expect("a link");
        }
        for name in ["a/x.mcap", "b/deep/er/y.mcap", "b/z.txt"] {
            std::fs::write(at(name), b"").expect("written");
        }
        let found = |pattern: &str| -> Vec<PathBuf> {
            let pattern = at(pattern).to_string_lossy().into_owned();
            let mut found = matching_paths(&pattern).expect("a pattern");
            found.sort();
            found
        };
        // A link to a file is that file.
        assert_eq!(found("**/*.mcap"), [at("a/x.mcap"), at("b/deep/er/y.mcap"), at("file.mcap")]);
        assert_eq!(found("b/**/er/*.mcap"), [at("b/deep/er/y.mcap")]);
        assert_eq!(found("?/**/*.mcap"), [at("a/x.mcap"), at("b/deep/er/y.mcap")]);
        assert_eq!(found("*/x.mcap"), [at("a/x.mcap")]);
    }
}
