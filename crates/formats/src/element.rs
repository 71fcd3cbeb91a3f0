//! XML, put together as a tree and written in one way.

use quick_xml::escape::partial_escape;
use std::fmt::Display;

/// An element with either elements or a text in it.
pub(crate) struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    inside: Vec<Element>,
    text: Option<String>,
}

impl Element {
    pub fn new(name: &'static str) -> Element {
        Element { name, attributes: Vec::new(), inside: Vec::new(), text: None }
    }

    pub fn with(mut self, key: &'static str, value: impl Display) -> Element {
        self.attributes.push((key, value.to_string()));
        self
    }

    pub fn text(self, text: impl Display) -> Element {
        Element { text: Some(text.to_string()), ..self }
    }

    pub fn holding(mut self, inside: impl IntoIterator<Item = Element>) -> Element {
        self.inside.extend(inside);
        self
    }

    /// The document with its mark and what its readers should know, both as comments.
    pub fn document(&self, mark: &str, comments: &[String]) -> String {
        let mut text = format!("<?xml version=\"1.0\"?>\n<!-- armcal.{mark} -->\n");
        for comment in comments {
            // Two hyphens end no sentence, but a comment.
            text += &format!("<!-- {} -->\n", without_control_chars(comment).replace("--", "- -"));
        }
        self.write(0, &mut text);
        text
    }

    fn write(&self, depth: usize, out: &mut String) {
        let (indent, name) = ("  ".repeat(depth), self.name);
        *out += &format!("{indent}<{name}");
        for (key, value) in &self.attributes {
            *out += &format!(
                " {key}=\"{}\"",
                partial_escape(without_control_chars(value)).replace('"', "&quot;")
            );
        }
        match &self.text {
            Some(text) => *out += &format!(">{}</{name}>\n", partial_escape(without_control_chars(text))),
            None if self.inside.is_empty() => *out += "/>\n",
            None => {
                *out += ">\n";
                self.inside.iter().for_each(|element| element.write(depth + 1, out));
                *out += &format!("{indent}</{name}>\n");
            }
        }
    }
}

/// Without characters that XML has no way to write.
fn without_control_chars(text: &str) -> String {
    text.replace(|c: char| c.is_control() && c != '\n', "_")
}
