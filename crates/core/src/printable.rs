//! Names from outside.

/// A name from outside, on one line and without control characters (a terminal would obey them).
pub fn printable_name(name: &str) -> String {
    name.chars()
        .flat_map(|c| {
            let escaped: Box<dyn Iterator<Item = char>> =
                if c.is_control() { Box::new(c.escape_default()) } else { Box::new(std::iter::once(c)) };
            escaped
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::printable_name;

    #[test]
    fn control_characters_do_not_reach_the_terminal() {
        assert_eq!(printable_name("a\u{1b}[31m\nb\u{9b}ü"), "a\\u{1b}[31m\\nb\\u{9b}ü");
    }
}
