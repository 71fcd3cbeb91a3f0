//! Parser of ROS message definitions (`ros2msg`, `ros1msg`) as MCAP stores them: the definition of the message,
//! then those it uses, separated by lines of `=` and headed `MSG: package/Type`.
//!
//! Grammar: <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html> and
//! <http://wiki.ros.org/msg>; concatenation: <https://mcap.dev/spec/registry#ros2msg>.

use super::types::{Field, Kind, MessageType, Number, Repeat, Types};
use std::collections::BTreeMap;

/// Parses the definitions of `schema` and of all messages it uses.
pub(super) fn parse(data: &[u8], schema: &str) -> Result<Types, String> {
    let text = std::str::from_utf8(data).map_err(|e| format!("its text is not UTF-8 ({e})"))?;
    let sections = split_sections(schema, text)?;

    // Indices are given out when a type is first used, the channel's own message first.
    let root = canonical_name(schema);
    let mut used: Vec<&str> = vec![&root];
    let mut index: BTreeMap<&str, usize> = BTreeMap::from([(root.as_str(), 0)]);
    let mut messages = Vec::new();
    while messages.len() < used.len() {
        let name = used[messages.len()];
        let Some((_, lines)) = sections.get_key_value(name) else {
            return Err(format!("it uses {name}, but does not define it"));
        };
        let mut fields = Vec::new();
        for (number, line) in lines {
            let parsed = parse_line(line).map_err(|why| format!("line {number}: {why}"))?;
            let Some((type_name, name_of_field, repeat)) = parsed else { continue };
            let kind = match builtin_kind(type_name) {
                Some(kind) => kind,
                None => match resolve_type(type_name, name, &sections) {
                    Resolved::Time => Kind::Time,
                    Resolved::Unknown => {
                        return Err(format!("line {number}: it uses {type_name}, but does not define it"));
                    }
                    Resolved::Message(full) => Kind::Message(*index.entry(full).or_insert_with(|| {
                        used.push(full);
                        used.len() - 1
                    })),
                },
            };
            fields.push(Field { name: name_of_field.to_owned(), kind, repeat });
        }
        messages.push(MessageType { fields });
    }
    Ok(Types { messages })
}

/// Lines of a definition with their numbers in the schema text.
type Lines<'a> = Vec<(usize, &'a str)>;

/// Splits the text into definitions by canonical name.
fn split_sections<'a>(schema: &str, text: &'a str) -> Result<BTreeMap<String, Lines<'a>>, String> {
    let mut sections: BTreeMap<String, Lines<'a>> = BTreeMap::new();
    let mut name = Some(canonical_name(schema));
    let mut lines: Lines<'a> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.len() >= 3 && line.bytes().all(|b| b == b'=') {
            // The first definition of a name counts, as in rosbag2, which may repeat one.
            if let Some(name) = name.take() {
                sections.entry(name).or_insert(std::mem::take(&mut lines));
            }
        } else if name.is_none() {
            match line.strip_prefix("MSG:") {
                Some(rest) => name = Some(canonical_name(rest.trim())),
                None if line.is_empty() => {}
                None => {
                    return Err(format!("line {}: expected `MSG: package/Type` after the separator", i + 1));
                }
            }
        } else {
            lines.push((i + 1, line));
        }
    }
    if let Some(name) = name {
        sections.entry(name).or_insert(lines);
    }
    Ok(sections)
}

/// `package/msg/Type` and `package/Type` are the same type.
fn canonical_name(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

enum Resolved<'a> {
    Message(&'a str),
    /// `builtin_interfaces/Time` or `Duration` that the text takes for granted.
    Time,
    Unknown,
}

/// Finds the definition that `type_name` means inside the definition of `user`.
fn resolve_type<'a>(type_name: &str, user: &str, sections: &'a BTreeMap<String, Lines<'_>>) -> Resolved<'a> {
    let package = user.split_once('/').map_or("", |(package, _)| package);
    let wanted = canonical_name(type_name);
    let mut candidates = vec![wanted.clone()];
    if !wanted.contains('/') {
        candidates.insert(0, format!("{package}/{wanted}"));
        if wanted == "Header" {
            candidates.push("std_msgs/Header".to_owned());
        }
    }
    for candidate in candidates {
        if let Some((name, _)) = sections.get_key_value(&candidate) {
            return Resolved::Message(name);
        }
    }
    match wanted.as_str() {
        "builtin_interfaces/Time" | "builtin_interfaces/Duration" => Resolved::Time,
        _ => Resolved::Unknown,
    }
}

/// Type, name and repetition of the field on a line; `None` for comments, blank lines and constants.
fn parse_line(line: &str) -> Result<Option<(&str, &str, Repeat)>, String> {
    // A `#` inside the default or the constant comes after the name, where nothing is read any more.
    let code = line.split('#').next().unwrap_or_default().trim();
    if code.is_empty() {
        return Ok(None);
    }
    let (type_text, rest) = code
        .split_once(char::is_whitespace)
        .ok_or_else(|| format!("`{code}` is not a field: expected a type and a name"))?;
    let rest = rest.trim_start();
    let name_end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, after) = rest.split_at(name_end);
    if name.is_empty() {
        return Err(format!("`{code}` has no field name"));
    }
    let after_spaces = after.trim_start();
    if after_spaces.starts_with('=') {
        return Ok(None);
    }
    if !after_spaces.is_empty() && after.len() == after_spaces.len() {
        return Err(format!("`{code}`: unexpected `{after}` after the field name"));
    }
    let (base, repeat) = split_repeat(type_text)?;
    // The bound of a text, as in `string<=10`, does not change its layout.
    let base = base.split_once("<=").map_or(base, |(base, _)| base);
    if base.is_empty() || !base.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'/') {
        return Err(format!("`{type_text}` is not a type"));
    }
    Ok(Some((base, name, repeat)))
}

/// Splits `float64[6]`, `float64[]`, `float64[<=6]` into the type and how often it is repeated.
fn split_repeat(type_text: &str) -> Result<(&str, Repeat), String> {
    let Some(open) = type_text.find('[') else { return Ok((type_text, Repeat::Once)) };
    let (base, bracket) = type_text.split_at(open);
    let inside = bracket
        .strip_prefix('[')
        .and_then(|b| b.strip_suffix(']'))
        .ok_or_else(|| format!("`{type_text}`: the bracket is not closed"))?;
    if inside.is_empty() || inside.starts_with("<=") {
        return Ok((base, Repeat::Sequence));
    }
    match inside.parse() {
        // rosidl refuses it too; in a message without bytes, loops over it would cost nothing and never end.
        Ok(0) => Err(format!("`{type_text}`: a fixed list has at least one element")),
        Ok(count) => Ok((base, Repeat::Fixed(count))),
        Err(_) => Err(format!("`{type_text}`: `{inside}` is not a number of elements")),
    }
}

/// The primitive types of ROS 1 and ROS 2; `byte` and `char` are one byte in both.
fn builtin_kind(name: &str) -> Option<Kind> {
    Some(match name {
        "bool" | "byte" | "char" | "uint8" => Kind::Number(Number::Unsigned(1)),
        "int8" => Kind::Number(Number::Signed(1)),
        "uint16" => Kind::Number(Number::Unsigned(2)),
        "int16" => Kind::Number(Number::Signed(2)),
        "uint32" => Kind::Number(Number::Unsigned(4)),
        "int32" => Kind::Number(Number::Signed(4)),
        "uint64" => Kind::Number(Number::Unsigned(8)),
        "int64" => Kind::Number(Number::Signed(8)),
        "float32" => Kind::Number(Number::Float(4)),
        "float64" => Kind::Number(Number::Float(8)),
        "string" => Kind::Text,
        "wstring" => Kind::WideText,
        "time" | "duration" => Kind::Time,
        _ => return None,
    })
}
