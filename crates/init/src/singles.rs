//! Numbers that have a field each: which of them belong together, by the names of the robot's joints or by their own numbers.

use super::lists::{List, Row};
use armcal_recording::decode::{Place, Plan, Role, Rows};
use std::collections::BTreeMap;

/// More single numbers than this in a message are no state of an arm.
const MOST: usize = 128;

/// The numbers of a message that have a field each.
#[derive(Default)]
pub struct Singles {
    paths: Vec<String>,
    plan: Option<Plan>,
    rows: Vec<Row>,
}

impl Singles {
    /// At these paths, read by the plan that `compile` makes of them.
    pub fn of(mut paths: Vec<String>, compile: impl FnOnce(&[(Place, &str)]) -> Option<Plan>) -> Singles {
        paths.truncate(MOST);
        if paths.len() < 2 {
            return Singles::default();
        }
        let fields: Vec<(Place, &str)> = paths.iter().map(|p| (Place::Positions, p.as_str())).collect();
        let plan = compile(&fields);
        Singles { paths, plan, rows: Vec::new() }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.plan.is_none()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// Looks into a message, whose number and time [ns] these are.
    pub fn add(&mut self, at: (u64, u64), log_ns: i64, data: &[u8]) {
        let mut rows = Rows::new(Role::Joints);
        let decoded = self.plan.as_ref().map(|plan| plan.decode(data, &mut rows));
        if let (Some(Ok(())), Rows::Joints(rows)) = (decoded, &rows) {
            let rows = rows.rows().filter(|row| row.position.len() == self.paths.len());
            self.rows.extend(rows.map(|row| (at, row.stamp_ns.unwrap_or(log_ns), row.position.to_vec())));
        }
    }

    /// Some of them as a list, from the messages that have them all.
    pub fn list(&self, columns: &[usize]) -> List {
        let row = |(at, time_ns, values): &Row| {
            let values: Vec<f64> = columns.iter().map(|k| values[*k]).collect();
            values.iter().all(|x| x.is_finite()).then_some((*at, *time_ns, values))
        };
        let paths = columns.iter().map(|k| self.paths[*k].clone()).collect();
        List { paths, rows: self.rows.iter().filter_map(row).collect(), ..List::default() }
    }

    /// Those that differ in a number alone, which counts from 0 or 1: `q1`, `q2`, ..
    pub fn numbered(&self) -> Vec<List> {
        let mut groups: BTreeMap<(&str, &str), Vec<(u32, usize)>> = BTreeMap::new();
        for (column, path) in self.paths.iter().enumerate() {
            if let Some((before, number, after)) = last_number(path) {
                groups.entry((before, after)).or_default().push((number, column));
            }
        }
        let in_a_row = |mut group: Vec<(u32, usize)>| {
            group.sort_unstable();
            let first = group[0].0;
            let counts = group.iter().zip(first..).all(|((number, _), wanted)| *number == wanted);
            (counts && first < 2 && group.len() > 1).then_some(group)
        };
        let lists = groups.into_values().filter_map(in_a_row);
        lists.map(|group| self.list(&group.iter().map(|(_, column)| *column).collect::<Vec<_>>())).collect()
    }

    /// Those that are called as joints are, with the same before and behind the name of each.
    pub fn called(&self, joints: &[String]) -> Vec<List> {
        let texts: Vec<String> = self.paths.iter().map(|path| plain(path)).collect();
        let mut found: Vec<(Vec<usize>, Vec<String>)> = Vec::new();
        // A joint may be a field without the word: `elbow` for `elbow_joint`.
        for of in [|name: &str| name.to_owned(), without_word] {
            let mut groups: BTreeMap<(&str, &str), BTreeMap<usize, usize>> = BTreeMap::new();
            for (joint, name) in joints.iter().enumerate() {
                let name = of(&plain(name));
                for (column, text) in texts.iter().enumerate() {
                    for around in places_of(&name, text) {
                        groups.entry(around).or_default().entry(joint).or_insert(column);
                    }
                }
            }
            for group in groups.into_values().filter(|group| group.len() > 1) {
                let columns: Vec<usize> = group.values().copied().collect();
                if found.iter().all(|(known, _)| *known != columns) {
                    found.push((columns, group.keys().map(|joint| joints[*joint].clone()).collect()));
                }
            }
        }
        found.into_iter().map(|(columns, names)| List { names, ..self.list(&columns) }).collect()
    }
}

/// A path or a name without what only its spelling needs.
fn plain(path: &str) -> String {
    path.replace('\'', "").to_lowercase()
}

fn without_word(name: &str) -> String {
    let bare = name.strip_suffix("joint").or_else(|| name.strip_prefix("joint")).unwrap_or(name);
    bare.trim_matches(['_', '-', '.', ' ']).to_owned()
}

/// What is before and behind a name wherever a text has it as a word of its own.
fn places_of<'a>(name: &str, text: &'a str) -> Vec<(&'a str, &'a str)> {
    if name.is_empty() {
        return Vec::new();
    }
    let around = text.match_indices(name).map(|(at, _)| (&text[..at], &text[at + name.len()..]));
    let parts = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric());
    around
        .filter(|(before, after)| parts(before.chars().next_back()) && parts(after.chars().next()))
        .collect()
}

/// The last number in a text, and what is before and behind it.
fn last_number(text: &str) -> Option<(&str, u32, &str)> {
    let end = text.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = text[..end]
        .rfind(|c: char| !c.is_ascii_digit())
        .map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
    Some((&text[..start], text[start..end].parse().ok()?, &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn singles(paths: &[&str]) -> Singles {
        let paths: Vec<String> = paths.iter().map(|p| (*p).to_owned()).collect();
        let values = (0..paths.len()).map(|k| k as f64).collect();
        Singles { rows: vec![((1, 1), 0, values)], paths, plan: None }
    }

    fn names(joints: &[&str]) -> Vec<String> {
        joints.iter().map(|j| (*j).to_owned()).collect()
    }

    #[test]
    fn fields_called_as_joints_are_found_with_anything_around_the_name() {
        let joints = names(&["shoulder_pan_joint", "elbow_joint", "gripper"]);
        for around in ["@", "'@.pos'", "@_position", "arm.@.q", "measured_@", "'Left.@'"] {
            for name in ["shoulder_pan_joint elbow_joint", "shoulder_pan elbow", "Shoulder_Pan Elbow"] {
                let own: Vec<String> = name.split(' ').rev().map(|n| around.replace('@', n)).collect();
                let all = ["t", own[0].as_str(), "elbow_temperature", own[1].as_str(), "gripper_force"];
                let found = singles(&all).called(&joints);
                assert_eq!(found.len(), 1, "{all:?}");
                assert_eq!(found[0].paths, [own[1].clone(), own[0].clone()]);
                assert_eq!(found[0].names, joints[..2]);
                assert_eq!(found[0].rows[0].2, [3.0, 1.0]);
            }
        }
        // A joint's name inside another word is none.
        assert!(singles(&["q11", "q12", "xq1"]).called(&names(&["q1", "q2"])).is_empty());
    }

    #[test]
    fn positions_and_velocities_are_two_lists() {
        let all = ["a.pos", "a.vel", "b.pos", "b.vel"];
        let paths: Vec<Vec<String>> =
            singles(&all).called(&names(&["a", "b"])).into_iter().map(|l| l.paths).collect();
        assert_eq!(paths, [["a.pos", "b.pos"], ["a.vel", "b.vel"]]);
    }

    #[test]
    fn numbers_that_count_are_lists_in_their_order() {
        let all = [
            "t", "q10", "q2", "q1", "q3", "q4", "q5", "q6", "q7", "q8", "q9", "j0.rad", "j1.rad", "v2", "v3",
            "w1",
        ];
        let found: Vec<String> = singles(&all).numbered().into_iter().map(|l| l.paths.join(" ")).collect();
        assert_eq!(found, ["j0.rad j1.rad", "q1 q2 q3 q4 q5 q6 q7 q8 q9 q10"]);
        assert_eq!(last_number("\u{e9}12\u{e9}"), Some(("\u{e9}", 12, "\u{e9}")));
        assert_eq!(last_number("99999999999"), None);
    }
}
