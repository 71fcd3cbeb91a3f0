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
        self.field.as_ref().map_or_else(|| self.topic.clone(), |f| format!("{}:{}", self.topic, f.position))
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
    /// Path of the positions.
    pub position: String,
    /// Path of the names of the joints, if they have any.
    pub name: Option<String>,
    /// How many joints.
    pub values: usize,
    /// How sure it is that these are positions: 3 where velocities tell their change, down to 0 where they are velocities.
    pub surety: u8,
    /// Why they are taken for positions.
    pub why: String,
}
