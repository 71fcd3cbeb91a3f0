//! Sentences as the text panels of viewers show them whole.

/// From 512 characters on Lichtblick hides the rest of a text behind a button.
const LONGEST: usize = 480;
/// What begins an entry that goes on with the one before.
const ON: &str = ".. ";

/// Entries that are shown whole, in words: Lichtblick takes `->` for a change between two messages and colours it as one.
pub(crate) fn for_viewer(entries: impl IntoIterator<Item = String>) -> Vec<String> {
    entries.into_iter().flat_map(|entry| split_entry(&entry.replace(" -> ", " to "))).collect()
}

/// In pieces that are short enough, each broken between two words.
fn split_entry(entry: &str) -> Vec<String> {
    let mut pieces = vec![String::new()];
    for word in entry.split(' ') {
        let piece = pieces.last_mut().expect("there is one from the start");
        if !piece.is_empty() && piece.chars().count() + 1 + word.chars().count() > LONGEST {
            pieces.push(format!("{ON}{word}"));
            continue;
        }
        if !piece.is_empty() {
            piece.push(' ');
        }
        piece.push_str(word);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_lost_and_nothing_is_too_long() {
        let long = "a formula of many terms + ".repeat(60);
        let shown = for_viewer([long.clone(), "error 0.4 -> 0.3 mm".to_owned()]);
        assert!(shown.len() > 3 && shown.iter().all(|entry| entry.chars().count() < 512));
        let again: Vec<&str> = shown[..shown.len() - 1].iter().map(|e| e.trim_start_matches(ON)).collect();
        assert_eq!(again.join(" "), long);
        assert_eq!(shown[shown.len() - 1], "error 0.4 to 0.3 mm");
    }
}
