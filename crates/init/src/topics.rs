//! Topics that may be an arm's joints or a tracked body.

/// A topic of joint readings.
#[derive(Debug, Clone, PartialEq)]
pub struct JointTopic {
    /// Its topic.
    pub topic: String,
    /// The joints it names, in the order of the messages; empty where it names none.
    pub names: Vec<String>,
    /// Messages in all recordings.
    pub messages: u64,
    /// Where they are in a message that armcal does not know.
    pub field: Option<Field>,
}

impl JointTopic {
    /// What `--joints` calls it.
    pub fn shown(&self) -> String {
        let shown = |f: &Field| format!("{}:{}", self.topic, f.positions.join(","));
        self.field.as_ref().map_or_else(|| self.topic.clone(), shown)
    }

    /// The same for these of its joints, in this order, where each has a path of its own.
    pub fn of_joints(&self, joints: &[String]) -> JointTopic {
        let mut of = self.clone();
        if let Some(field) = of.field.as_mut().filter(|f| f.name.is_none() && !self.names.is_empty()) {
            let place = |joint: &String| self.names.iter().position(|name| name == joint);
            let path = |joint| self.field.as_ref()?.positions.get(place(joint)?).cloned();
            field.positions = joints.iter().filter_map(path).collect();
            field.values = joints.len();
            of.names = joints.to_vec();
        }
        of
    }
}

/// A tracked body.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct BodyTopic {
    /// Its topic.
    pub topic: String,
    /// Its name, where the topic has several.
    pub body: Option<String>,
    /// The frame that it is compared with others in, where they hang on several.
    pub frame: Option<String>,
    /// Where it is in a message that armcal does not know.
    pub position: Option<String>,
    /// With `position`: how it is turned.
    pub orientation: Option<String>,
}

impl BodyTopic {
    /// What it is called where people read it.
    pub fn shown(&self) -> String {
        let what =
            [&self.body, &self.position].into_iter().flatten().cloned().collect::<Vec<_>>().join(" at ");
        if what.is_empty() { self.topic.clone() } else { format!("{what} of {}", self.topic) }
    }
}

/// Where joint readings are in a message.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Path of the positions, or one for each joint.
    pub positions: Vec<String>,
    /// Path of the names of the joints, if a field has them.
    pub name: Option<String>,
    /// How many joints.
    pub values: usize,
    /// How sure it is that these are positions: 3 where velocities tell their change, down to 0 where they are velocities.
    pub surety: u8,
    /// Why they are taken for positions.
    pub why: String,
}

impl Field {
    /// Whether the names of all fields say that they are in degrees, as `q1_deg` and `A1 [deg]` do.
    pub fn says_degrees(&self) -> bool {
        let says = |path: &String| {
            let lower = path.to_lowercase();
            let mut words = lower.split(|c: char| !c.is_alphanumeric() && c != '\u{b0}');
            words.any(|word| ["deg", "degree", "degrees", "\u{b0}"].contains(&word))
        };
        !self.positions.is_empty() && self.positions.iter().all(says)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_in_the_names_of_all_fields_is_theirs() {
        let says = |paths: &[&str]| {
            let positions = paths.iter().map(|path| (*path).to_owned()).collect();
            Field { positions, name: None, values: paths.len(), surety: 2, why: String::new() }.says_degrees()
        };
        assert!(says(&["q1_deg", "q2_deg"]) && says(&["'A1 [\u{b0}]'"]) && says(&["joints_degrees[]"]));
        assert!(!says(&["q1", "q2_deg"]) && !says(&["q1"]) && !says(&[]));
    }
}
