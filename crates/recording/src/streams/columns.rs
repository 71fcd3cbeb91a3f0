//! Columns that were read in parts.

/// One column of its parts in order, copied once if there are several.
pub(crate) fn concat_parts<T>(mut parts: Vec<Vec<T>>) -> Vec<T> {
    parts.retain(|part| !part.is_empty());
    if parts.len() < 2 {
        return parts.pop().unwrap_or_default();
    }
    let mut whole = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    parts.into_iter().for_each(|mut part| whole.append(&mut part));
    whole
}
